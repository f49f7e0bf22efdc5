// The catalogue of effects: one file per effect in this folder, registered in catalogue.cc.
#ifndef CAMGYRO_CORE_EFFECTS_CATALOGUE_H_
#define CAMGYRO_CORE_EFFECTS_CATALOGUE_H_

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/effects/effect.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// All effects (docs/effects.md).
const std::vector<EffectEntry>& EffectCatalogue();

// Null if there is none of this name.
const EffectEntry* FindEffect(const std::string& name);

// Some effects with their parameters side by side.
class EffectSet {
 public:
  struct Item {
    const EffectEntry* entry;
    std::string shape;
    std::shared_ptr<const Effect> effect;
    int first = 0;  // column of its first parameter
    // Standard deviation of the prior of each parameter, in its unit; 0: EffectParameter::spread.
    double usual_sigma = 0.0;
  };

  // What all effects change at one observation; columns as the parameters of the set.
  struct Change {
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> lens;
    std::array<Eigen::Matrix<double, kLensSize, Eigen::Dynamic>, 2> lens_slope;  // or empty
    Eigen::Matrix<double, 3, Eigen::Dynamic> time;
  };

  void Add(const EffectEntry* entry, std::string shape, std::shared_ptr<const Effect> effect,
           double usual_sigma = 0.0);
  void Add(const Item& other) { Add(other.entry, other.shape, other.effect, other.usual_sigma); }

  const std::vector<Item>& items() const { return items_; }
  int size() const { return size_; }
  bool empty() const { return items_.empty(); }
  bool Has(const std::string& name) const;
  EffectParameter parameter(int column) const;  // its spread: that of the prior in this set

  void ChangeObservation(const Observation& observation, Change* change) const;
  // Returns the change at `values` [rad/s]; the columns are its derivatives by them.
  Eigen::Vector3d ChangeRate(double time_gyro_s, const Eigen::Vector3d& omega_gyro_rad_s,
                             const double* values, RateColumns columns) const;
  Eigen::Matrix3d RateByRate(const double* values) const;
  // The lens block with the effects that are a constant part of it.
  LensParameters ConstantLens(const LensParameters& lens, const Eigen::VectorXd& values) const;
  // How many parameters of the lens, from the first on, the effects may change; 0: none.
  int num_lens() const;
  // The widest prior of a latent that an effect asks for; 0: none does.
  double widened_sigma(PairLatent latent) const;
  // Whether one of them does (Effect::follows_own_time).
  bool follows_own_time() const;
  // Column of the spread of the frames' own times; -1: they have none.
  int frame_time_spread() const;

 private:
  std::vector<Item> items_;
  int size_ = 0;
  bool has_lens_slope_ = false;
};

// Effects of the catalogue at their present size. Both null: none.
struct PairEffects {
  const EffectSet* set = nullptr;
  const double* values = nullptr;  // set->size() of them
  // Standard deviation of the frames' own times around their stamps [s]; 0: they have none.
  double frame_time_spread_s() const {
    const int column = set != nullptr ? set->frame_time_spread() : -1;
    return column < 0 ? 0.0 : values[column];
  }
};

// What the user asks for: "name" or "name:shape", separated by commas; without a shape, the usual
// one of those that the recording can show. "usual:CLASS" stands for all others that devices of a
// class usually have and this recording can show, each with its usual size as the standard
// deviation of its prior (core/effects/device_class.h); without a class, a phone's. Errors:
// kBadUsage for an unknown name, shape or class (with all that are known); kCannotEstimate if the
// recording cannot show the effect.
Result<EffectSet> MakeEffects(const std::string& list, const EffectSetup& setup);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_CATALOGUE_H_
