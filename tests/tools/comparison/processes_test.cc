#include "tools/comparison/processes.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>

namespace camgyro::comparison {
namespace {

using testing::HasSubstr;

TEST(Processes, AnswersComeInOrderFromOtherProcesses) {
  const pid_t here = getpid();
  std::vector<int> told;
  const auto answers = RunInProcesses(
      7, 3,
      [&](int i) -> Result<std::string> {
        usleep(static_cast<useconds_t>(1000 * (7 - i)));  // the later ones end first
        return std::to_string(i) + (getpid() == here ? " here" : " there");
      },
      [&](int done) { told.push_back(done); });
  ASSERT_EQ(answers.size(), 7u);
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(answers[static_cast<size_t>(i)].value(), std::to_string(i) + " there");
  }
  EXPECT_THAT(told, testing::ElementsAre(1, 2, 3, 4, 5, 6, 7));
}

TEST(Processes, LongAnswersPass) {
  const auto answers = RunInProcesses(2, 2, [](int i) -> Result<std::string> {
    return std::string(3'000'000, static_cast<char>('a' + i));  // a pipe holds 64 kB
  });
  EXPECT_EQ(answers[0].value(), std::string(3'000'000, 'a'));
  EXPECT_EQ(answers[1].value(), std::string(3'000'000, 'b'));
}

TEST(Processes, ErrorsKeepTheirKindAndCrashesAreErrors) {
  const auto answers = RunInProcesses(4, 2, [](int i) -> Result<std::string> {
    if (i == 0) return BadInput("line 3");
    if (i == 1) raise(SIGKILL);
    if (i == 2) _exit(7);
    return std::string();
  });
  ASSERT_FALSE(answers[0]);
  EXPECT_EQ(answers[0].error().kind, ErrorKind::kBadInput);
  EXPECT_EQ(answers[0].error().message, "line 3");
  ASSERT_FALSE(answers[1]);
  EXPECT_EQ(answers[1].error().kind, ErrorKind::kCannotEstimate);
  EXPECT_THAT(answers[1].error().message, HasSubstr("Killed"));
  ASSERT_FALSE(answers[2]);
  EXPECT_THAT(answers[2].error().message, HasSubstr("without an answer"));
  ASSERT_TRUE(answers[3]);
  EXPECT_EQ(*answers[3], "");
}

}  // namespace
}  // namespace camgyro::comparison
