// Faults that the data show without a fit.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_

#include <string>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// A property of the data, named as in the catalogue where that has it.
struct DataFault {
  std::string name;
  std::string finding;
  std::string advice;
  int count = 1;  // of samples, frames, gaps, or of the fault itself
};

// Samples at the full scale, dropped and duplicated frames, dropped samples, a rate of samples that
// is not what the file declares.
std::vector<DataFault> FindDataFaults(const Recording& recording);

// Leaves out frames that repeat the picture before them, one or several in a row, while the camera
// moves: their stamps belong to another picture. For tracks without identity across such a frame
// nothing is lost. Records the fault and returns how many; a recording with repeats in more than
// half of the places stays as it is.
int DropRepeatedPictures(Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_
