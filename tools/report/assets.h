// Files that every report carries inside; assets.cc is made from them by CMake.
#ifndef CAMGYRO_TOOLS_REPORT_ASSETS_H_
#define CAMGYRO_TOOLS_REPORT_ASSETS_H_

namespace camgyro::assets {

extern const char* const kDygraphJs;       // dygraphs (MIT licence), minified
extern const char* const kDygraphCss;      // its style sheet
extern const char* const kSynchronizerJs;  // dygraphs' extra: charts that zoom together
extern const char* const kReportJs;        // report.js
extern const char* const kReportCss;       // report.css

}  // namespace camgyro::assets

#endif  // CAMGYRO_TOOLS_REPORT_ASSETS_H_
