// Small sound recordings of the formats that are folders of text, file by file: what tests read,
// and damage. Videos, of three pictures 40 ms apart, are not in them (LoggerFolder::WriteVideo).
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_SOUND_LOGS_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_SOUND_LOGS_H_

#include <map>
#include <string>

namespace camgyro {

using Files = std::map<std::string, std::string>;

inline const Files kGcsv = {
    {"a.gcsv",
     "GYROFLOW IMU LOG\nversion,1.3\nid,test\norientation,YxZ\nnote,of a test, with a comma\n"
     "frame_readout_time,15.5\nframe_readout_direction,1\ntscale,0.001\ngscale,0.5\nascale,0.25\n"
     "t,gx,gy,gz,ax,ay,az\n0,1,2,3,4,0,0\n5,-1,2,3,0,4,0\n10,1,2,3,0,0,4\n"}};

inline const Files kMars = {
    {"gyro_accel.csv",
     "Timestamp[nanosec],gx[rad/s],gy[rad/s],gz[rad/s],ax[m/s^2],ay[m/s^2],az[m/s^2],"
     "Unix time[nanosec]\n1000000000,0.1,0.2,0.3,0,0,9.8,1600000000000000000\n"
     "1005000000,0.4,0.2,0.3,0,0,9.8,1600000000005000000\n"},
    {"frame_timestamps.txt", "Frame timestamp[nanosec]\n1000000000\n1033333000\n1066666000\n"},
    // One more than the video has; the first without an exposure.
    {"movie_metadata.csv",
     "Timestamp[nanosec],fx[px],fy[px],Frame No.,Exposure time[nanosec],Sensor frame "
     "duration[nanosec],Frame readout time[nanosec],ISO,Focal length,Focus distance,AF mode\n"
     "1000000000,500,501,1,null,33333333,20000000,100,4.2,0.1,0\n"
     "1033333333,500,502,2,5000000,33333333,20000000,100,4.2,0.1,0\n"
     "1066666666,500,503,3,6000000,33333333,20000000,100,4.2,0.1,0\n"
     "1100000000,500,900,4,7000000,33333333,20000000,100,4.2,0.1,0\n"}};

inline const Files kOpenCamera = {
    {"VID_1_gyro.csv", "0.1,0.2,0.3,1000000000\n0.4,0.2,0.3,1005000000\n"},
    {"VID_1_accel.csv", "0,0,9.8,999000000\n0,0.1,9.8,1004000000\n0,0,9.7,1009000000\n"},
    {"VID_1_timestamps.csv", "1000000000\n1040000000\n1080000000\n"}};

inline const Files kSensorLogger = {
    {"Gyroscope.csv",
     "time,seconds_elapsed,z,y,x\n1698501144401773000,0.2,9,9,9\n1698501144411773000,0.21,9,9,9\n"},
    {"GyroscopeUncalibrated.csv",
     "time,seconds_elapsed,z,y,x\n1698501144401773000,0.2,0.3,0.2,0.1\n"
     "1698501144411773000,0.21,0.6,0.5,0.4\n"},
    {"TotalAcceleration.csv",
     "time,seconds_elapsed,z,y,x\n1698501144401773000,0.2,9.8,0,1\n"
     "1698501144411773000,0.21,9.8,0,2\n"}};

inline const Files kStray = {
    {"imu.csv",
     "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n"
     "100.5, 0.5, -9.75, 0.0, 0.125, 0.25, 0.5\n100.51, 0.5, -9.75, 0.0, 0.25, 0.25, 0.5\n"},
    {"odometry.csv",
     "timestamp, frame, x, y, z, qx, qy, qz, qw\n100.5, 000000, 0, 0, 0, 0.6, 0, 0, 0.8\n"
     "100.54, 000001, 0, 0, 0, 0, 0, 0, 1\n100.58, 000002, 0, 0, 0, 0, 0, 0, 1\n"},
    {"camera_matrix.csv", "50.0, 0.0, 31.5\n0.0, 40.0, 23.5\n0.0, 0.0, 1.0"}};

inline const Files kIos = {
    {"Gyro.txt", "1600000000.5,0.125,0.25,0.5\r\n1600000000.51,0.25,0.25,0.5\r\n"},
    {"Accel.txt", "1600000000.5,0,-1,0\r\n1600000000.51,0,-1,0.5\r\n"},
    {"Frames.txt",
     "1600000000.5,0,500,502,320,240\r\n1600000000.54,1,501,503,320,240\r\n"
     "1600000000.58,2,502,501,320,240\r\n"},
    {"ARposes.txt", "1600000000.5,0,0,0,0.8,0.6,0,0\r\n1600000000.75,0,0,0,1,0,0,0\r\n"}};

inline const Files kJsonl = {
    {"data.jsonl",
     R"({"sensor":{"type":"gyroscope","values":[0.125,0.25,0.5]},"time":10.5})"
     "\n"
     R"({"sensor":{"type":"accelerometer","values":[0,0,9.75]},"time":10.502})"
     "\n"
     R"({"frames":[{"cameraInd":1,"time":7},{"cameraInd":0,"cameraParameters":{)"
     R"("focalLengthX":50,"focalLengthY":40,"principalPointX":31.5,"principalPointY":23.5},)"
     R"("exposureTimeSeconds":0.005,"time":10.5}],"number":0,"time":10.501})"
     "\n\n"
     R"({"sensor":{"type":"gyroscope","values":[0.25,0.25,0.5]},"time":10.505})"
     "\n"
     R"({"sensor":{"type":"barometer","values":[1013]},"time":10.506})"
     "\n"
     R"({"frames":[{"cameraInd":0}],"time":10.54})"
     "\n"
     R"({"arcore":{"position":{"x":1}},"time":10.55})"
     "\n"
     R"({"frames":[{"cameraInd":0}],"time":10.58})"
     "\n"}};

inline const Files kDescribed = {
    {"recording.yaml",
     "gyro:\n  file: sensors/gyro.csv\n  separator: ';'\n  time: t_us\n  time_unit: us\n"
     "  time_offset_s: 100\n  columns: [wx, wy, wz]\n  unit: deg/s\n"
     "accel:\n  file: sensors/accel.csv\n  time: 4\n  time_unit: ms\n  columns: [1, 2, 3]\n"
     "  unit: -g\n"
     "camera:\n  video: clip.mp4\n  frames: frames.csv\n  time: start [s]\n  time_unit: s\n"
     "  exposure: exposure [ms]\n  exposure_unit: ms\n  sensor_yaml: camera.yaml\n"},
    {"sensors/gyro.csv", "n;wz;t_us;wy;wx\n0;30;500000;60;90\n1;30;505000;60;180\n"},
    {"sensors/accel.csv", "# of the phone\n0,0,-1,100500\n0,-1,0,100505\n"},
    {"frames.csv", "start [s],exposure [ms]\n100.5,5\n100.54,5\n100.58,10\n"},
    {"camera.yaml", "intrinsics: [50, 40, 31.5, 23.5]\nreadout_time: 0.02\n"}};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_SOUND_LOGS_H_
