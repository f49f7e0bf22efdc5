#include "estimator/window/residuals/all_residuals.h"

#include "estimator/window/pair_graph_options.h"

namespace camgyro {
namespace {

// "a, b" + last + "c"
std::string Join(const std::vector<std::string>& phrases, const std::string& last) {
  std::string all;
  for (size_t i = 0; i < phrases.size(); ++i) {
    if (i > 0) all += i + 1 < phrases.size() ? ", " : last;
    all += phrases[i];
  }
  return all;
}

}  // namespace

std::vector<const PairResidual*> ChoosableResiduals() {
  std::vector<const PairResidual*> residuals;
#define CAMGYRO_ADD(name) \
  if (!By##name().facts().of_attitudes) residuals.push_back(&By##name());
  CAMGYRO_RESIDUALS(CAMGYRO_ADD)
#undef CAMGYRO_ADD
  return residuals;
}

Result<const PairResidual*> FindResidual(const std::string& name) {
  std::vector<std::string> names;
  for (const PairResidual* residual : ChoosableResiduals()) {
    if (residual->facts().name == name) return residual;
    names.emplace_back(residual->facts().name);
  }
  return BadUsage("--residual=" + name + ": expected " + Join(names, " or "));
}

std::string HelpOfResiduals() {
  std::vector<std::string> phrases;
  for (const PairResidual* residual : ChoosableResiduals()) {
    phrases.emplace_back(residual->facts().help);
  }
  return Join(phrases, ", or ");
}

const PairResidual& ResidualOf(const TimedPair& pair, const PairGraphOptions& options) {
  return pair.of_attitudes() ? ByAttitudes() : *options.residual;
}

}  // namespace camgyro
