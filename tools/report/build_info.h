// Which camgyro this is.
#ifndef CAMGYRO_TOOLS_REPORT_BUILD_INFO_H_
#define CAMGYRO_TOOLS_REPORT_BUILD_INFO_H_

namespace camgyro {

extern const char* const kVersion;
// The commit it was built from, with "-dirty" if files differed from it; "unknown" without git.
extern const char* const kGitCommit;
// System, processor and kind of build.
extern const char* const kPlatform;

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_BUILD_INFO_H_
