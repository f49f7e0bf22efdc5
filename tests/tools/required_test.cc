#include "tools/required.h"

#include <gflags/gflags.h>
#include <gmock/gmock.h>

DECLARE_string(require);

namespace camgyro {
namespace {

using testing::HasSubstr;

TEST(Required, ComplainsAboutWhatIsNotDetermined) {
  const gflags::FlagSaver saver;
  Calibration c;
  ASSERT_FALSE(CheckDetermined(c));
  EXPECT_EQ(CheckDetermined(c).error().kind, ErrorKind::kCannotEstimate);
  EXPECT_THAT(CheckDetermined(c).error().message, HasSubstr("none of the parameters"));

  c.determined.fill(true);
  c.determined[kStateReadout] = c.determined[kStateBias + 1] = false;
  EXPECT_TRUE(CheckDetermined(c));
  FLAGS_require = "delay,focal";
  EXPECT_TRUE(CheckRequireFlag());
  EXPECT_TRUE(CheckDetermined(c));
  FLAGS_require = "delay,readout";
  EXPECT_TRUE(CheckRequireFlag());
  ASSERT_FALSE(CheckDetermined(c));
  EXPECT_THAT(CheckDetermined(c).error().message, HasSubstr("not determined: readout_s"));
  for (const char* group : {"bias", "rotation", "mounting", "principal", "focal_px", "cx_px"}) {
    FLAGS_require = group;
    EXPECT_TRUE(CheckRequireFlag()) << group;
    EXPECT_EQ(CheckDetermined(c).has_value(), FLAGS_require != "bias") << group;
  }
}

TEST(Required, NamesAreChecked) {
  const gflags::FlagSaver saver;
  FLAGS_require = "delay,colour";
  const Status known = CheckRequireFlag();
  ASSERT_FALSE(known);
  EXPECT_EQ(known.error().kind, ErrorKind::kBadUsage);
  EXPECT_THAT(known.error().message, HasSubstr("`colour` is none of focal"));
}

}  // namespace
}  // namespace camgyro
