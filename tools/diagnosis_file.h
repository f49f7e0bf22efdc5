// What `diagnose` writes and says.
#ifndef CAMGYRO_TOOLS_DIAGNOSIS_FILE_H_
#define CAMGYRO_TOOLS_DIAGNOSIS_FILE_H_

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnose.h"

namespace camgyro {

// Names, with commas between them.
std::string Joined(const std::vector<std::string>& words);

// What was estimated of a candidate, in readable units: "x 0.014 ± 0.0068, ..."; four values at
// most.
std::string ValuesText(const CandidateResult& candidate);

// diagnosis.yaml (docs/result_format.md).
std::string DiagnosisYaml(const Diagnosis& diagnosis);

// residual_maps.csv: every cell of every map, before and after the effects.
std::string ResidualMapsCsv(const Diagnosis& diagnosis);

// What was looked for beyond: "the plain model", or the one that has effects.
std::string NameOfModel(const Diagnosis& diagnosis);

// Of a round that has added nothing: what came nearest, and why it is not named.
std::string NothingAddedText(const DiagnosisRound& round);

// The account in the terminal: what was found, how sure, before and after, what to do.
std::string DiagnosisText(const Diagnosis& diagnosis, bool attitudes);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_DIAGNOSIS_FILE_H_
