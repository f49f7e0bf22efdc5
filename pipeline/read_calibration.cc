#include "pipeline/read_calibration.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/pair_model.h"
#include "pipeline/device.h"

namespace camgyro {
namespace {

// Something wrong at a place of the file; caught in ReadCalibration.
struct Complaint {
  YAML::Mark mark;
  std::string text;
};

// Quantities of one section of the file.
class Section {
 public:
  Section(const YAML::Node& root, std::string name) : name_(std::move(name)), node_(root[name_]) {
    if (node_ && !node_.IsMap()) Fail(node_, "", "expected a map of keys to values");
  }
  // An entry of a list of the section `name`.
  Section(std::string name, const YAML::Node& entry) : name_(std::move(name)), node_(entry) {
    if (!node_.IsMap()) Fail(node_, "", "expected a map of keys to values");
  }

  // The numbers of `key: {value: ...}` or `key: ...`; none if the key is absent.
  std::vector<double> Numbers(const char* key, size_t count) const {
    const YAML::Node value = Value(key);
    if (!value) return {};
    std::vector<double> numbers;
    try {
      numbers = value.IsSequence() ? value.as<std::vector<double>>()
                                   : std::vector<double>{value.as<double>()};
    } catch (const YAML::Exception&) {
      Fail(value, key, "expected " + Amount(count));
    }
    if (numbers.size() != count) {
      Fail(value, key, "expected " + Amount(count) + ", got " + std::to_string(numbers.size()));
    }
    for (const double number : numbers) {
      if (!std::isfinite(number)) Fail(value, key, "expected a finite number");
    }
    return numbers;
  }

  double Number(const char* key, double absent) const {
    const std::vector<double> numbers = Numbers(key, 1);
    return numbers.empty() ? absent : numbers[0];
  }

  // A whole number that an int holds; 0 if the key is absent.
  int Count(const char* key) const {
    const double number = Number(key, 0.0);
    if (!(number >= 0.0 && number <= 2147483647.0 && number == std::floor(number))) {
      Fail(Value(key), key, "expected a whole number");
    }
    return static_cast<int>(number);
  }

  double Positive(const char* key, double absent) const {
    const double number = Number(key, absent);
    if (!(number > 0.0)) Fail(Value(key), key, "expected a number above zero");
    return number;
  }

  YAML::Node Value(const char* key) const {
    const YAML::Node node = Child(key);
    return node && node.IsMap() ? node["value"] : node;
  }

  YAML::Node Child(const char* key) const {
    return node_ ? node_[key] : YAML::Node(YAML::NodeType::Undefined);
  }

  [[noreturn]] void Fail(const YAML::Node& where, const std::string& key,
                         const std::string& message) const {
    const YAML::Node& nearest = where ? where : node_;
    throw Complaint{nearest ? nearest.Mark() : YAML::Mark::null_mark(),
                    name_ + ": " + (key.empty() ? "" : key + ": ") + message};
  }

 private:
  static std::string Amount(size_t count) {
    return count == 1 ? "a number" : "a list of " + std::to_string(count) + " numbers";
  }

  std::string name_;
  YAML::Node node_;
};

void ParseLens(const Section& camera, Calibration* c) {
  for (const char* key : {"resolution", "focal_px"}) {
    if (!camera.Value(key)) {
      camera.Fail(YAML::Node(YAML::NodeType::Undefined), key,
                  "is missing; expected a calibration.yaml of camgyro");
    }
  }
  const double focal_px = camera.Positive("focal_px", 0.0);
  const std::vector<double> size = camera.Numbers("resolution", 2);
  for (const double pixels : size) {
    if (!(pixels >= 1.0 && pixels <= 65536.0 && pixels == std::floor(pixels))) {
      camera.Fail(camera.Value("resolution"), "resolution",
                  "expected [width, height], whole numbers of pixels");
    }
  }
  c->width_px = static_cast<int>(size[0]);
  c->height_px = static_cast<int>(size[1]);
  std::vector<double> principal = camera.Numbers("principal_px", 2);
  if (principal.empty()) principal = {0.5 * (size[0] - 1.0), 0.5 * (size[1] - 1.0)};
  c->lens =
      MakePinhole(focal_px, {principal[0], principal[1]}, camera.Positive("aspect_ratio", 1.0));

  const YAML::Node distortion = camera.Child("distortion");
  if (!distortion) return;
  const YAML::Node model = distortion.IsMap() ? distortion["model"] : distortion;
  const auto name = model && model.IsScalar() ? model.as<std::string>() : std::string();
  if (name == DistortionModelName(DistortionModel::kNone)) return;
  for (const auto known : {DistortionModel::kRadTan, DistortionModel::kKannalaBrandt}) {
    if (name == DistortionModelName(known)) c->distortion_model = known;
  }
  if (c->distortion_model == DistortionModel::kNone) {
    camera.Fail(model, "distortion",
                "model: `" + name + "` is unknown, expected none, radtan or kannala_brandt");
  }
  const std::vector<double> k = camera.Numbers("distortion", 4);
  if (k.empty()) {
    camera.Fail(distortion, "distortion",
                "expected value: [k1, k2, p1, p2] (radtan) or [k1, k2, k3, k4] (kannala_brandt)");
  }
  std::copy(k.begin(), k.end(), c->lens.data() + FirstCoefficient(c->distortion_model));
}

// Index of a parameter's name, or -1: parameters that Calibration does not hold may stand beside.
int StateOf(const std::string& name) {
  const auto& names = StateNames();
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::vector<std::string> Names(const Section& section, const char* key) {
  const YAML::Node node = section.Child(key);
  if (!node) return {};
  try {
    return node.as<std::vector<std::string>>();
  } catch (const YAML::Exception&) {
    section.Fail(node, key, "expected a list of parameter names");
  }
}

// The matrix `key` of the section into the parameters that `order` names. False: it is not there.
bool ParseMatrix(const Section& section, const char* key, const std::vector<std::string>& order,
                 StateCovariance* covariance) {
  const YAML::Node matrix = section.Child(key);
  if (!matrix) return false;
  const std::string expected =
      "expected a square matrix of finite numbers, a row for each name of order";
  std::vector<std::vector<double>> rows;
  try {
    rows = matrix.as<std::vector<std::vector<double>>>();
  } catch (const YAML::Exception&) {
    section.Fail(matrix, key, expected);
  }
  const auto bad_row = [&](const std::vector<double>& row) {
    return row.size() != order.size() ||
           !std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); });
  };
  if (rows.size() != order.size() || std::any_of(rows.begin(), rows.end(), bad_row)) {
    section.Fail(matrix, key, expected);
  }
  for (size_t i = 0; i < order.size(); ++i) {
    for (size_t j = 0; j < order.size(); ++j) {
      const int row = StateOf(order[i]), column = StateOf(order[j]);
      if (row >= 0 && column >= 0) (*covariance)(row, column) = rows[i][j];
    }
  }
  return true;
}

void ParseCovariance(const Section& section, Calibration* c) {
  const std::vector<std::string> order = Names(section, "order");
  if (!ParseMatrix(section, "matrix", order, &c->covariance) && !order.empty()) {
    section.Fail(YAML::Node(YAML::NodeType::Undefined), "matrix",
                 "expected a square matrix of finite numbers, a row for each name of order");
  }
  StateCovariance total = StateCovariance::Zero();
  if (ParseMatrix(section, "total", order, &total)) c->total_covariance = total;
}

Calibration Parse(const YAML::Node& root) {
  if (!root.IsMap()) {
    throw Complaint{YAML::Mark::null_mark(), "expected the keys of a calibration.yaml of camgyro"};
  }
  Calibration c;
  ParseLens(Section(root, "camera"), &c);
  c.readout_s = Section(root, "shutter").Number("readout_s", 0.0);
  c.delay_s = Section(root, "clock").Number("delay_s", 0.0);
  const std::vector<double> bias = Section(root, "gyro").Numbers("bias_rad_s", 3);
  if (!bias.empty()) c.bias_gyro_rad_s = {bias[0], bias[1], bias[2]};
  const Section extrinsics(root, "extrinsics");
  const std::vector<double> q = extrinsics.Numbers("q_gyro_cam_wxyz", 4);
  if (!q.empty()) {
    c.q_gyro_cam = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    // Ten digits are written; an entry that is off by 1e-3 was mistyped.
    if (std::abs(c.q_gyro_cam.norm() - 1.0) > 1e-3) {
      extrinsics.Fail(extrinsics.Value("q_gyro_cam_wxyz"), "q_gyro_cam_wxyz",
                      "expected a quaternion of norm 1");
    }
    c.q_gyro_cam.normalize();
  }
  ParseCovariance(Section(root, "covariance"), &c);
  c.determined.fill(true);
  for (const std::string& name : Names(Section(root, "quality"), "unobservable")) {
    const int index = StateOf(name);
    if (index >= 0) c.determined[static_cast<size_t>(index)] = false;
  }
  return c;
}

constexpr char kColumns[] = "readout_direction";

// An effect in the file: a mapping, or its name alone.
std::string NameOfEffect(const YAML::Node& effect) {
  const YAML::Node name = effect.IsMap() ? effect["name"] : effect;
  if (!name || !name.IsScalar()) {
    throw Complaint{effect.Mark(), "effects: expected a list of {name: ...}"};
  }
  return name.Scalar();
}

std::vector<ListedEffect> ParseEffects(const YAML::Node& root) {
  std::vector<ListedEffect> listed;
  const YAML::Node effects = root.IsMap() ? root["effects"] : YAML::Node();
  for (const YAML::Node& effect : effects) {
    ListedEffect& one = listed.emplace_back();
    one.name = NameOfEffect(effect);
    if (!effect.IsMap()) continue;
    if (const YAML::Node shape = effect["shape"]; shape && shape.IsScalar()) {
      one.shape = shape.Scalar();
    }
    for (const YAML::Node& parameter : effect["parameters"]) {
      one.values.push_back(Section("effects", parameter).Number("value", 0.0));
    }
  }
  return listed;
}

// Of the effect that reads columns.
double ParseColumnReadout(const YAML::Node& root) {
  double sum_s = 0.0;
  for (const ListedEffect& effect : ParseEffects(root)) {
    if (effect.name != kColumns) continue;
    for (const double value : effect.values) sum_s += value;
  }
  return sum_s;
}

// The state's numbers under a key that has to be there.
StateVector StateNumbers(const Section& section, const char* key) {
  const std::vector<double> numbers = section.Numbers(key, kStateSize);
  if (numbers.empty()) {
    section.Fail(YAML::Node(YAML::NodeType::Undefined), key,
                 "is missing; expected a calibration.yaml that this camgyro has written");
  }
  return StateVector::Map(numbers.data());
}

void ParseShares(const YAML::Node& root, CalibrationReport* report) {
  const YAML::Node systematic = root["systematic"];
  if (!systematic || !systematic.IsMap()) return;
  const YAML::Node device = systematic["device"];
  if (device && device.IsScalar()) report->device_class = device.Scalar();
  for (const YAML::Node& share : systematic["effects"]) {
    const Section numbers("systematic", share);
    const YAML::Node name = numbers.Child("name");
    if (!name || !name.IsScalar()) numbers.Fail(name, "name", "expected the name of an effect");
    report->systematic.push_back({name.Scalar(), StateNumbers(numbers, "sigma")});
  }
}

CalibrationReport ParseReport(const YAML::Node& root) {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c = Parse(root);
  for (const ListedEffect& effect : ParseEffects(root)) {
    // Of columns the file's covariance holds all that the parameters have to do with them.
    if (!IsEffectOfDevice(effect.name) || effect.name == kColumns) continue;
    throw Complaint{
        root["effects"].Mark(),
        "effects: " + effect.name + ": expected a calibration without it, to be combined"};
  }
  const Section prior(root, "prior");
  report.prior.mean = Moved(c, StateNumbers(prior, "offset"));
  report.prior.sigma = StateNumbers(prior, "sigma");
  if (!(report.prior.sigma.minCoeff() > 0.0)) {
    prior.Fail(prior.Child("sigma"), "sigma", "expected numbers above zero");
  }
  // Else no inverse means anything.
  if (!(c.covariance.llt().info() == Eigen::Success)) {
    throw Complaint{root["covariance"].Mark(), "covariance: matrix: expected a covariance"};
  }
  ParseShares(root, &report);
  const Section quality(root, "quality");
  report.quality.pairs = quality.Count("pairs");
  report.quality.matches = quality.Count("matches");
  report.quality.inlier_ratio = quality.Number("inlier_ratio", 0.0);
  report.quality.noise_px = quality.Number("noise_px", 0.0);
  report.quality.noise_scatter = quality.Number("noise_scatter", 0.0);
  report.quality.design_effect = quality.Number("design_effect", 1.0);
  report.quality.rms_px = quality.Number("rms_px", 0.0);
  return report;
}

std::string Place(const std::string& path, const YAML::Mark& mark) {
  return mark.is_null() ? path : path + ":" + std::to_string(mark.line + 1);
}

template <typename T>
Result<T> ParseFile(const std::string& path, T (*parse)(const YAML::Node& root)) {
  try {
    return parse(YAML::LoadFile(path));
  } catch (const Complaint& complaint) {
    return BadInput(Place(path, complaint.mark) + ": " + complaint.text);
  } catch (const YAML::BadFile&) {
    return BadInput(path + ": cannot be opened for reading; expected a calibration.yaml");
  } catch (const YAML::Exception& error) {
    return BadInput(Place(path, error.mark) + ": not valid YAML: " + error.msg);
  }
}

}  // namespace

Result<Calibration> ReadCalibration(const std::string& path) { return ParseFile(path, Parse); }

Result<CalibrationReport> ReadCalibrationReport(const std::string& path) {
  return ParseFile(path, ParseReport);
}

Result<Calibration> ReadCalibrationOfRows(const std::string& path) {
  const Result<double> columns_s = ParseFile(path, ParseColumnReadout);
  if (!columns_s) return tl::unexpected(columns_s.error());
  Result<Calibration> calibration = ReadCalibration(path);
  if (calibration && ReadsColumns(calibration->readout_s, *columns_s)) {
    return BadInput(path + ": " + kReadsColumns);
  }
  return calibration;
}

Result<std::vector<ListedEffect>> ReadEffects(const std::string& path) {
  return ParseFile(path, ParseEffects);
}

}  // namespace camgyro
