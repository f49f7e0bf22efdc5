// Every number by which the diagnosis decides something, with its unit and where it comes from.
// (Rules on the recording itself, before any fit, are with data_faults.)
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_THRESHOLDS_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_THRESHOLDS_H_

#include <cstddef>

namespace camgyro {

// ---- The shares of a recording (shares.cc; tests/diagnosis/shares_test.cc) ----

// A stretch is this part of the recording, within these limits [s], and has at least so many
// frames: short enough that what changes with time is seen by all shares, long enough for pairs.
constexpr double kBlocksPerRecording = 40.0;
constexpr double kShortestBlockS = 0.2, kLongestBlockS = 3.0;
// The scores of a block are 0.15 MB for all candidates, 0.7 MB for the maps: at most so many
// blocks, which 15 minutes have of 3 s.
constexpr double kMostBlocks = 300.0;
constexpr double kLeastFramesOfBlock = 6.0;
// And it is so many times as long as a pair, since pairs across its ends are in no share: of two,
// half of them stay. Where nothing is near, pairs span 0.8 s (SelectPairs).
constexpr double kLeastPairsOfBlock = 2.0;
// At most so many pairs begin in a second. Pairs of one stretch overlap in time, and share the
// gyro's noise; the more of them there are, the more that is of what their scores have in common,
// which the tests take for independent. Of 60 frames/s every second frame begins one, as of slower
// cameras; of 240 clock_skew was named where nothing is wrong, and the smallest p of 22 candidates
// was 0.00003 to 0.004 (docs/lab/pairs.md, "Fast cameras").
constexpr double kMostPairsPerS = 30.0;
// Pairs of the report share that have matches of their own tracks, below which it shares tracks.
constexpr size_t kLeastReportPairs = 20;

// ---- What the loop needs and spends (shared_fits.cc, find_effects.cc) ----

// Below, the scatter between stretches says nothing and a fit stands on too few pairs
// (FindEffects.SaysIfThereIsTooLittleToTest).
constexpr size_t kLeastBlocks = 4;
constexpr int kLeastFitPairs = 25, kLeastChoicePairs = 25;
// Of recordings with pixels. A fit needs no more to tell effects apart: what it gets wrong within
// its noise is projected out of the test. Time is spent on the refits.
constexpr size_t kMostFitPairs = 400, kMostChoicePairs = 800;
// Of the frames that show what was gained: an hour's would be 10 000, with 90 MB of matches.
constexpr size_t kMostReportPairs = 2000;
// Of the maps [frames]: what comes and goes within some frames is to be seen
// (FindEffects.NamesAPeriodicGlitchOfTheStamps).
constexpr int kNearGap = 3;
// Of the test of the frames' times [frames].
constexpr int kNearestGap = 1;
// Rounds of noise scale and solve in a share's fit; its estimate need not settle to the last digit.
constexpr int kFitRounds = 4;
// Of the robust loss where nothing of the recording is known yet: attitudes [rad], pixels [px].
constexpr double kFirstNoiseRad = 2e-3, kFirstNoisePx = 1.0;

// ---- Significance (score_test.cc, step_search.cc; tests/diagnosis/score_test_test.cc) ----

// Information of a direction over that of the prior, below which it is not tested.
constexpr double kLeastInformation = 1.0;
// Degrees of freedom that the scatter of all candidates together is worth at most, since their
// tests are not independent.
constexpr double kMostScatterDof = 50.0;
// Prior of a step of the delay [s]: as its effect's plausible range, a quarter of it.
constexpr double kStepPriorS = 0.05;
// A step is searched this many stretches away from either end, and placed within as many.
constexpr double kStepMarginBlocks = 1.5;

// ---- Gain on unseen frames (gain_rule.cc; tests/diagnosis/gain_rule_test.cc) ----

constexpr double kNoDoubt = 1e-5;       // p of all candidates together
constexpr double kNoiseAlone = 2.0;     // inflation below which the noise is the model's
constexpr double kGainSigmas = 2.0;     // beyond its scatter, or the noise of a right effect's gain
constexpr double kHardlyAnyLoss = 0.1;  // of the gain, lost in the stretches that become worse
// A gain in the report share of no more than so much of its scatter does not confirm an effect that
// would show there. It chooses nothing, and the share is half of that which chooses: twice would
// doubt many that are right (docs/lab/closed_loop.md has gains beside what was expected).
constexpr double kConfirmingSigmas = 1.0;

// ---- The contest of refitted rivals (contest.cc; docs/lab/diagnosis_simulated.md) ----

// Rivals with less of the best one's linear gain are not refitted.
constexpr double kLeastGainOfRival = 0.25;
// A rival contains the fit without it, whose noise it cannot exceed: one that does by this factor
// after two rounds leads nowhere. Of the rivals of phone-edge-hand and ov_handheld_rs, those that
// settle are at 1.03 of it at most, steps of the delay that are none at 2.4 and more (by prints
// that are not in the program; Contest.GivesUpARivalThatLeadsNowhere).
constexpr double kMostNoiseOfRival = 1.5;
// So many, those of the largest gains, are refitted before the others, whose noise is then held
// against theirs: one misfit often has two names or shapes (clock_skew and delay_wander, two series
// of a lens), and most machines two cores.
constexpr size_t kFirstRivals = 2;
// A linear gain of one effect over chi2, beyond which the model is so far off that it says little
// (FindEffects.ChoosesTheSeriesOfAWideLens).
constexpr double kStrongMisfit = 0.02;
// One with fewer parameters wins if it is behind by less than so many sigmas of the difference.
constexpr double kBehindSigmas = 2.0;
// The plain fit is astray: its focal length has changed by this part, its centre by this part of
// the diagonal. (Real centres stay within 3 % of the diagonal.)
constexpr double kAstrayFocal = 0.15, kAstrayCentre = 0.05;

// ---- A large step of the delay (step_time.cc; FindEffects.NamesAStepThatIsBeyondTheLoss) ----

constexpr double kScanS = 0.1, kScanStepS = 2e-3;  // delays tried: to both sides, and how far apart
constexpr size_t kScanPairs = 3;                   // of each stretch
constexpr double kGoodPart = 0.3;  // of the misfit that comes and goes, which a step explains

// ---- Structure without a name (structure.cc) ----

// p of all maps together, as a part of DiagnoseOptions::significance: maps are many, and what they
// say is no more than that something is left (docs/lab/diagnosis_simulated.md, clean recordings).
constexpr double kStructureSignificance = 0.1;
// Noise changes with what is seen: stretches misfit by up to 3.5 times those that fit well where
// nothing else is wrong (iphone-cards); wrong by more than the loss is 8.
constexpr double kLeastMisfit = 4.0;
// Wrong matches come in flocks: variance of a stretch's chi2 over that of independent matches.
constexpr double kOverdispersion = 4.0;
// The scatter of the delay from pair to pair depends on the noise model to some percent: it must be
// larger by half, and without doubt.
constexpr double kLeastFrameScatter = 1.5, kFrameScatterP = 1e-6;
// A misfit that comes and goes with time, for which a scan for a step of the delay and a refit are
// spent: a walk loses less to the loss than a run.
constexpr double kMisfitToScan = 2.0, kMisfitToScanP = 1e-3;

// ---- Frames' own times (frame_time_test.cc; tests/diagnosis/frame_time_test_test.cc) ----

// Choices of signs of the permutation test: its least p, 5e-5, is beyond what a candidate among
// some thirty needs at a significance of 0.01.
constexpr int kSignChoices = 20000;
// Below, signs have too few choices to say anything at that level (2^25).
constexpr size_t kLeastPairsOfHalves = 25;
// Weak priors that keep pairs which turn fast from being all that is heard: of an offset [s], as
// small as is worth finding, and of a rotation between two frames, over the time between them
// [rad/s], some 0.1 px of it at 30 frames per second; and the largest offset [s], which is that of
// the effect.
constexpr double kTimesPriorS = 1e-3, kRestPriorRadS = 0.01, kMostTimesS = 30e-3;
// What the halves have in common besides times is significant at this p; then the times need this
// share of it all. A rotation about any axis, of gyro noise or of a picture that shakes, has two
// thirds of it along the two frames' own rotations at most.
constexpr double kRestP = 0.01, kLeastShareOfTimes = 0.75;
// Spread of the offsets in pairs of near frames over that in pairs of far ones: 0.8 to 1 of stamps
// that scatter, 0.1 of a delay that wanders within seconds, 0.2 (one frame over five) of a gyro's
// error.
constexpr double kLeastNearSpread = 0.5;

// ---- What the verdict says beside effects ----

// A factor of the sigmas below this one is no doubt, and would be printed as 1.0 (model_check.cc).
constexpr double kLeastFactorSaid = 1.05;
// Unseen parallax is said in words where it is so many sigmas of the bias' noise (model_check.cc).
constexpr double kUnseenSaid = 3.0;

// Canonical correlation of two effects beyond which this motion cannot tell them apart, and how
// many more parameters one may have: a flexible curve contains simpler effects (candidates.cc).
constexpr double kAliasLimit = 0.95;
constexpr size_t kAliasFactor = 3, kAliasMore = 3;
// Sigmas by which a readout time is negative before rows are said to be read from bottom to top.
constexpr double kReversedSigmas = 5.0;

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_THRESHOLDS_H_
