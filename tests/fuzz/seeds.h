// Sound files to begin with, as bytes, where they are not text. Small: a fuzzer damages what is
// short in more ways.
#ifndef CAMGYRO_TESTS_FUZZ_SEEDS_H_
#define CAMGYRO_TESTS_FUZZ_SEEDS_H_

#include <string>

namespace camgyro {

std::string VideoBytes();                                // three pictures of 64 x 48
std::string GoProBytes();                                // the same with two seconds of telemetry
std::string Telemetry(int second);                       // GPMF of one second
std::string PictureBytes(const std::string& extension);  // ".png", ...: 64 x 48
// Messages begin to end of Drive().
std::string SqliteBytes(int begin = 0, int end = 7, const std::string& compression = "");
std::string RosbagBytes(bool compressed);  // empty where librosbag is not
std::string VideoMetaBytes();              // VideoIMUCapture
std::string CalibrationBytes();            // as `calibrate` writes it
std::string TruthBytes();                  // the sample's truth.yaml

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FUZZ_SEEDS_H_
