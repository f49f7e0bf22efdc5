#include "tools/diagnosis_file.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

using testing::HasSubstr;

CandidateResult Candidate(const std::string& name, double p_value, const std::string& rejected) {
  CandidateResult candidate;
  candidate.name = name;
  candidate.p_value = p_value;
  candidate.significant = p_value < 1e-3;
  candidate.rejected = rejected;
  return candidate;
}

TEST(DiagnosisText, SaysWhatCameNearest) {
  DiagnosisRound round;
  round.candidates = {Candidate("gyro_scale", 0.4, "not significant"),
                      Candidate("aspect_ratio", 0.1, "not significant")};
  EXPECT_THAT(NothingAddedText(round), HasSubstr("nothing more is significant"));
  EXPECT_THAT(NothingAddedText(round), HasSubstr("of 2 candidates the nearest is aspect_ratio"));
}

TEST(DiagnosisText, SaysWhySomethingSignificantIsNotNamed) {
  DiagnosisRound round;
  round.candidates = {Candidate("gyro_scale", 0.4, "not significant"),
                      Candidate("delay_step", 1.3e-9, "no gain on unseen frames")};
  const std::string text = NothingAddedText(round);
  EXPECT_THAT(text, HasSubstr("delay_step is significant, p = 1.3e-09"));
  EXPECT_THAT(text, HasSubstr("no gain on unseen frames"));
  EXPECT_THAT(text, Not(HasSubstr("nothing more is significant")));
}

TEST(DiagnosisText, SaysWhatUnseenFramesDoNotConfirm) {
  DiagnosisRound round;
  round.candidates = {Candidate("gyro_scale", 1e-9, "")};
  round.added = "gyro_scale";
  round.report_gain.sum = -1.0;
  round.report_gain.sigma = 10.0;
  round.expected_gain = 22.0;
  Diagnosis diagnosis;
  diagnosis.effects = {"gyro_scale"};
  diagnosis.rounds = {round};
  constexpr char kSays[] = "verdict    gyro_scale; not confirmed by unseen frames: gyro_scale\n";
  EXPECT_THAT(DiagnosisText(diagnosis, true),
              testing::AllOf(HasSubstr(kSays),
                             HasSubstr("-1 ± 10, 22 expected: they do not confirm it\n")));
  EXPECT_THAT(DiagnosisYaml(diagnosis), HasSubstr("unconfirmed: [gyro_scale]"));
  diagnosis.rounds[0].expected_gain = 3.0;
  EXPECT_THAT(DiagnosisText(diagnosis, true), HasSubstr("-1 ± 10 (too little to tell)\n"));
  diagnosis.rounds[0].report_gain.sum = 11.0;
  EXPECT_THAT(DiagnosisText(diagnosis, true), HasSubstr("chi2 falls by 11 ± 10\n"));
  EXPECT_THAT(DiagnosisText(diagnosis, true), HasSubstr("verdict    gyro_scale\n"));
  EXPECT_THAT(DiagnosisYaml(diagnosis), HasSubstr("unconfirmed: []"));
}

}  // namespace
}  // namespace camgyro
