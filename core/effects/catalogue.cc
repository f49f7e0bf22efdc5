#include "core/effects/catalogue.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/effects/device_class.h"
#include "core/effects/entries.h"

namespace camgyro {

const std::vector<EffectEntry>& EffectCatalogue() {
  static const std::vector<EffectEntry> catalogue = {RadialDistortionEntry(),
                                                     TangentialDistortionEntry(),
                                                     AspectRatioEntry(),
                                                     FocalDriftEntry(),
                                                     OpticalStabilisationEntry(),
                                                     ClockSkewEntry(),
                                                     DelayStepEntry(),
                                                     DelayWanderEntry(),
                                                     FrameStampJitterEntry(),
                                                     ReadoutDirectionEntry(),
                                                     ReadoutNonlinearEntry(),
                                                     GyroScaleEntry(),
                                                     GyroMisalignmentEntry(),
                                                     GyroLowpassEntry(),
                                                     GyroAxisDelayEntry(),
                                                     GyroSaturationEntry(),
                                                     BiasDriftEntry(),
                                                     GyroGSensitivityEntry(),
                                                     ExposureLowpassEntry(),
                                                     ExposureDelayEntry(),
                                                     TranslationAccelerationEntry(),
                                                     AttitudeRollingShutterEntry(),
                                                     ElectronicStabilisationEntry()};
  return catalogue;
}

const EffectEntry* FindEffect(const std::string& name) {
  for (const EffectEntry& entry : EffectCatalogue()) {
    if (entry.name == name) return &entry;
  }
  return nullptr;
}

void EffectSet::Add(const EffectEntry* entry, std::string shape,
                    std::shared_ptr<const Effect> effect, double usual_sigma) {
  const int columns = effect->size();
  has_lens_slope_ = has_lens_slope_ || effect->has_lens_slope();
  items_.push_back({entry, std::move(shape), std::move(effect), size_, usual_sigma});
  size_ += columns;
}

bool EffectSet::Has(const std::string& name) const {
  return std::any_of(items_.begin(), items_.end(),
                     [&](const Item& item) { return item.entry->name == name; });
}

EffectParameter EffectSet::parameter(int column) const {
  for (const Item& item : items_) {
    if (column < item.first + item.effect->size()) {
      EffectParameter own = item.effect->parameters()[static_cast<size_t>(column - item.first)];
      if (item.usual_sigma > 0.0) own.spread = item.usual_sigma;
      return own;
    }
  }
  return {};
}

void EffectSet::ChangeObservation(const Observation& observation, Change* change) const {
  change->lens.setZero(kLensSize, size_);
  change->time.setZero(3, size_);
  for (const Item& item : items_) {
    const int n = item.effect->size();
    item.effect->ChangeLens(observation, change->lens.middleCols(item.first, n));
    item.effect->ChangeTime(observation, change->time.middleCols(item.first, n));
  }
  if (!has_lens_slope_) return;
  for (auto& slope : change->lens_slope) slope.setZero(kLensSize, size_);
  for (const Item& item : items_) {
    const int n = item.effect->size();
    item.effect->ChangeLensSlope(observation, change->lens_slope[0].middleCols(item.first, n),
                                 change->lens_slope[1].middleCols(item.first, n));
  }
}

Eigen::Vector3d EffectSet::ChangeRate(double time_gyro_s, const Eigen::Vector3d& omega_gyro_rad_s,
                                      const double* values, RateColumns columns) const {
  columns.setZero();
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  for (const Item& item : items_) {
    change += item.effect->ChangeRateBy(time_gyro_s, omega_gyro_rad_s, values + item.first,
                                        columns.middleCols(item.first, item.effect->size()));
  }
  return change;
}

Eigen::Matrix3d EffectSet::RateByRate(const double* values) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Item& item : items_) sum += item.effect->RateByRate(values + item.first);
  return sum;
}

LensParameters EffectSet::ConstantLens(const LensParameters& lens,
                                       const Eigen::VectorXd& values) const {
  LensParameters sum = lens;
  for (const Item& item : items_) {
    if (!item.effect->is_constant_lens()) continue;
    const int n = item.effect->size();
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> columns =
        Eigen::Matrix<double, kLensSize, Eigen::Dynamic>::Zero(kLensSize, n);
    item.effect->ChangeLens({}, columns);
    sum += columns * values.segment(item.first, n);
  }
  return sum;
}

int EffectSet::num_lens() const {
  int number = 0;
  for (const Item& item : items_) {
    if (item.entry->part != ModelPart::kLens) continue;
    if (!item.effect->is_constant_lens()) return kLensSize;  // which, may depend on where and when
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> columns =
        Eigen::Matrix<double, kLensSize, Eigen::Dynamic>::Zero(kLensSize, item.effect->size());
    item.effect->ChangeLens({}, columns);
    for (int k = number; k < kLensSize; ++k) {
      if (!columns.row(k).isZero(0.0)) number = k + 1;
    }
  }
  return number;
}

double EffectSet::widened_sigma(PairLatent latent) const {
  double sigma = 0.0;
  for (const Item& item : items_) sigma = std::max(sigma, item.effect->widened_sigma(latent));
  return sigma;
}

bool EffectSet::follows_own_time() const {
  return std::any_of(items_.begin(), items_.end(),
                     [](const Item& item) { return item.effect->follows_own_time(); });
}

int EffectSet::frame_time_spread() const {
  for (const Item& item : items_) {
    if (item.effect->frees_frame_times()) return item.first;
  }
  return -1;
}

namespace {

constexpr char kUsual[] = "usual";

// What else devices of a class usually have and this recording can show. What the start has found
// is larger than usual, and comes from there. A lens that nobody has declared may be any lens, a
// wide one as well, which a prior of the usual size would pull towards none.
void AddUsual(const EffectSetup& setup, DeviceClass device, EffectSet* set) {
  for (const UsualEffect& usual : UsualEffects()) {
    const EffectEntry* entry = FindEffect(usual.effect);
    if (!(usual.Sigma(device) > 0.0) || IsDeclared(usual, setup.distortion_model)) continue;
    if (set->Has(entry->name) || (entry->found_at_start && entry->found_at_start(setup))) continue;
    const std::vector<std::string> shapes = entry->shapes(setup);
    if (std::find(shapes.begin(), shapes.end(), usual.shape) == shapes.end()) continue;
    std::shared_ptr<const Effect> effect = entry->make(setup, usual.shape);
    if (effect == nullptr || effect->size() == 0) continue;
    set->Add(entry, usual.shape, std::move(effect),
             entry->leads_astray ? 0.0 : usual.Sigma(device));
  }
}

}  // namespace

Result<EffectSet> MakeEffects(const std::string& list, const EffectSetup& setup) {
  EffectSet set;
  std::optional<DeviceClass> usual_of;
  for (size_t begin = 0; begin < list.size();) {
    const size_t end = std::min(list.find(',', begin), list.size());
    const std::string word = list.substr(begin, end - begin);
    begin = end + 1;
    const std::string name = word.substr(0, word.find(':'));
    if (name == kUsual) {
      const bool has_class = name.size() < word.size();
      const Result<DeviceClass> device =
          has_class ? DeviceClassOf(word.substr(name.size() + 1)) : DeviceClass::kPhone;
      if (!device) return BadUsage("--effects=" + word + ": " + device.error().message);
      usual_of = *device;
      continue;
    }
    std::string known;
    for (const EffectEntry& entry : EffectCatalogue()) known += " " + entry.name;
    const EffectEntry* entry = FindEffect(name);
    if (entry == nullptr) {
      return BadUsage("--effects: no effect \"" + name + "\"; expected some of" + known + ", or " +
                      kUsual);
    }
    const std::vector<std::string> shapes = entry->shapes(setup);
    const bool has_shape = name.size() < word.size();
    if (!has_shape && shapes.empty()) {
      return CannotEstimate("--effects: " + name +
                            " has no parameters that this recording could determine");
    }
    const std::string shape = has_shape ? word.substr(name.size() + 1) : shapes.back();
    std::shared_ptr<const Effect> effect = entry->make(setup, shape);
    if (effect == nullptr) {
      std::string expected;
      for (const std::string& s : shapes) expected += " " + s;
      return BadUsage("--effects: " + name + " has no shape \"" + shape + "\" here; expected" +
                      (expected.empty() ? " a number within the recording" : expected));
    }
    set.Add(entry, shape, std::move(effect));
  }
  if (usual_of) AddUsual(setup, *usual_of, &set);
  return set;
}

}  // namespace camgyro
