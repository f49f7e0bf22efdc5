// `camgyro compare CASE...`: estimators against the truth and against each other.
#include <gflags/gflags.h>

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "core/parallel.h"
#include "estimator/window/gyro_noise.h"
#include "pipeline/result_files.h"
#include "tools/commands.h"
#include "tools/comparison/comparison_report.h"
#include "tools/comparison/error_plot.h"
#include "tools/comparison/information_bound.h"
#include "tools/comparison/processes.h"
#include "tools/fit_flags.h"
#include "tools/progress_bar.h"
#include "tools/report/page.h"

DEFINE_string(estimators, "window,refinement,ekf", "which to run, in this order");
DEFINE_string(truth, "",
              "calibration.yaml to compare with, one per recording, separated by commas; default: "
              "truth.yaml in the recording");
DEFINE_int32(seeds, 8, "runs of each scenario, with its seed and the ones after it");
DEFINE_int32(jobs, 0, "processes at a time; without: one per core");
DEFINE_string(start, "auto",
              "where estimators begin: drawn (the truth, moved by a draw from the paper's standard "
              "deviations), declared (the paper's initial values around sensor.yaml), found (by "
              "the program's own search); auto: drawn for scenarios, declared for recordings");
DEFINE_int32(ekf_triplets, 100, "N of the filter");
DEFINE_double(ekf_sigma_px, 1.0, "pixel noise that the filter assumes");
DEFINE_double(ekf_gate, 0.0, "innovation gate of the filter, in sigmas; not in the paper");
DEFINE_int32(ekf_iterations, 1, "of the filter's update; not in the paper");
DECLARE_string(out);
DECLARE_bool(quiet);

namespace camgyro {

using comparison::Case;
using comparison::CaseResult;
using comparison::Input;
using comparison::SeedRun;
using comparison::StartKind;

namespace {

struct Plan {
  std::vector<std::string> estimators;
  std::vector<Case> cases;
  PairGraphOptions graph;
  EkfOptions ekf;
  int jobs = 1;
};

std::vector<std::string> Split(const std::string& list) {
  std::vector<std::string> items;
  std::stringstream stream(list);
  for (std::string item; std::getline(stream, item, ',');) items.push_back(item);
  return items;
}

Result<StartKind> StartOf(const Case& from) {
  if (FLAGS_start == "drawn") return StartKind::kDrawn;
  if (FLAGS_start == "declared") return StartKind::kDeclared;
  if (FLAGS_start == "found") return StartKind::kFound;
  if (FLAGS_start == "auto") return from.scenario ? StartKind::kDrawn : StartKind::kDeclared;
  return BadUsage("--start=" + FLAGS_start + ": expected auto, drawn, declared or found");
}

Status ReadFlags(Plan* plan) {
  plan->estimators = Split(FLAGS_estimators);
  const auto& known = comparison::EstimatorNames();
  if (plan->estimators.empty()) return BadUsage("--estimators: expected at least one");
  for (const std::string& name : plan->estimators) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return BadUsage("--estimators: `" + name + "`: expected window, refinement or ekf");
    }
  }
  if (Status read = ReadFitFlags(&plan->graph); !read) return read;
  if (FLAGS_seeds < 1) return BadUsage("--seeds: expected 1 or more");
  if (FLAGS_jobs < 0) return BadUsage("--jobs: expected 1 or more");
  if (FLAGS_ekf_triplets < 1) return BadUsage("--ekf_triplets: expected 1 or more");
  if (FLAGS_ekf_iterations < 1) return BadUsage("--ekf_iterations: expected 1 or more");
  if (!(FLAGS_ekf_sigma_px > 0.0)) return BadUsage("--ekf_sigma_px: expected a positive number");
  if (!(FLAGS_ekf_gate >= 0.0)) return BadUsage("--ekf_gate: expected 0 (none) or more");
  plan->jobs = FLAGS_jobs > 0 ? FLAGS_jobs : MostThreads();
  LimitThreads(MostThreads() / plan->jobs);  // of each process
  plan->ekf.triplets = FLAGS_ekf_triplets;
  plan->ekf.sigma_px = FLAGS_ekf_sigma_px;
  plan->ekf.gate_sigmas = FLAGS_ekf_gate;
  plan->ekf.iterations = FLAGS_ekf_iterations;
  return {};
}

// Words with a '=' change scenarios, the others are cases.
Status ReadCases(const std::vector<std::string>& arguments, Plan* plan) {
  std::vector<std::string> words, overrides;
  for (const std::string& word : arguments) {
    (word.find('=') == std::string::npos ? words : overrides).push_back(word);
  }
  if (words.empty()) return BadUsage("compare: no recording and no scenario given");
  const std::vector<std::string> truths = Split(FLAGS_truth);
  size_t recordings = 0;
  for (const std::string& word : words) {
    const std::string truth = recordings < truths.size() ? truths[recordings] : "";
    Result<Case> found = comparison::ResolveCase(word, overrides, truth);
    if (!found) return tl::unexpected(found.error());
    if (Result<StartKind> start = StartOf(*found); !start) return tl::unexpected(start.error());
    recordings += found->scenario ? 0 : 1;
    for (const Case& other : plan->cases) {
      if (other.name == found->name) return BadUsage("`" + found->name + "` is given twice");
    }
    plan->cases.push_back(std::move(*found));
  }
  if (!truths.empty() && truths.size() != recordings) {
    return BadUsage("--truth: " + std::to_string(truths.size()) + " files for " +
                    std::to_string(recordings) + " recordings");
  }
  if (!overrides.empty() && recordings == words.size()) {
    return BadUsage("`" + overrides.front() + "` changes scenarios, and there is none");
  }
  return {};
}

Result<std::string> RunSeed(const Plan& plan, const Case& from, uint64_t seed) {
  const Result<StartKind> start = StartOf(from);
  const Result<Input> input = comparison::MakeInput(from, seed, *start);
  if (!input) return tl::unexpected(input.error());
  SeedRun run;
  run.estimators = comparison::RunEstimators(plan.estimators, *input, plan.graph, plan.ekf);
  if (from.scenario) {
    run.bound = comparison::InformationBound(
        input->exact_matches, input->recording, input->truth, input->prior.sigma,
        std::max(1e-3, input->noise_px), GyroSigma(input->recording, input->truth.delay_s).mean());
  }
  return comparison::Pack(run);
}

Result<std::vector<CaseResult>> RunAll(const Plan& plan) {
  struct Task {
    size_t which;
    uint64_t seed;
  };
  std::vector<Task> tasks;
  for (size_t c = 0; c < plan.cases.size(); ++c) {
    const int count = plan.cases[c].scenario ? FLAGS_seeds : 1;
    for (int seed = 0; seed < count; ++seed) tasks.push_back({c, static_cast<uint64_t>(seed)});
  }
  ProgressBar bar;
  const auto answers = comparison::RunInProcesses(
      static_cast<int>(tasks.size()), plan.jobs,
      [&](int i) {
        const Task& task = tasks[static_cast<size_t>(i)];
        return RunSeed(plan, plan.cases[task.which], task.seed);
      },
      [&](int done) {
        bar.Show("runs", static_cast<double>(done) / static_cast<double>(tasks.size()));
      });
  std::vector<CaseResult> results(plan.cases.size());
  for (size_t i = 0; i < tasks.size(); ++i) {
    CaseResult& result = results[tasks[i].which];
    const Case& from = plan.cases[tasks[i].which];
    if (!answers[i]) {
      return tl::unexpected(Error{answers[i].error().kind, from.name + ", run " +
                                                               std::to_string(tasks[i].seed) +
                                                               ": " + answers[i].error().message});
    }
    result.name = from.name;
    if (from.scenario) result.noise_px = from.scenario->tracks.noise_px;
    result.runs.push_back(comparison::Unpack(*answers[i]));
  }
  for (CaseResult& result : results) {
    for (size_t e = 0; e < plan.estimators.size(); ++e) {
      result.statistics.push_back(comparison::Summarize(result.runs, e));
    }
  }
  return results;
}

Status RunCompare(const std::vector<std::string>& arguments) {
  Plan plan;
  if (Status read = ReadFlags(&plan); !read) return read;
  if (Status read = ReadCases(arguments, &plan); !read) return read;
  FileSet files(FLAGS_out);
  if (!FLAGS_out.empty()) {
    if (Status writable = files.CheckWritable(); !writable) return writable;
  }
  const Result<std::vector<CaseResult>> results = RunAll(plan);
  if (!results) return tl::unexpected(results.error());
  std::vector<ReportSection> sections;
  for (const CaseResult& result : *results) {
    const std::string table = CaseTable(result);
    std::printf("%s%s", &result == &results->front() ? "" : "\n", table.c_str());
    const int frames = result.runs.front().estimators.front().frames;
    const std::string svg = comparison::ErrorPlotSvg(
        result.name + ", " + std::to_string(frames) + " frames", result.runs.front());
    files.Add("errors_" + result.name + ".svg", svg);
    sections.push_back({"case-" + std::to_string(sections.size()), result.name,
                        "<pre>" + EscapeHtml(table) +
                            "</pre>\n<svg style=\"max-width:100%;height:auto\"" +
                            svg.substr(svg.find("<svg") + 4)});
  }
  if (FLAGS_out.empty()) return {};
  files.Add("report.html", ReportPage("Comparison with the truth", "", sections));
  files.Add("compare.md", comparison::ComparisonMarkdown(*results));
  files.Add("compare.yaml", comparison::ComparisonYaml(*results));
  files.Add("runs.csv", comparison::RunsCsv(*results));
  files.Add("traces.csv", comparison::TracesCsv(*results));
  if (Status written = files.Write(); !written) return written;
  if (!FLAGS_quiet) {
    std::printf(
        "\nwritten    %s/report.html, compare.md, compare.yaml, runs.csv, traces.csv, "
        "errors_*.svg\n",
        files.folder().c_str());
  }
  return {};
}

}  // namespace

Command CompareCommand() {
  Command command;
  command.name = "compare";
  command.arguments = "CASE... [KEY=VALUE...]";
  command.summary =
      "window, refinement and the paper's filter against the truth: tables and plots (CASE: a "
      "recording with truth.yaml; a scenario file; or the name of a motion: handheld, walking, "
      "running, panning, rotation, single_axis, slow. KEY=VALUE: section.key of the scenarios)";
  command.flags = {"out", "estimators"};
  for (const std::string& name : FitFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(),
                       {"seeds", "jobs", "start", "truth", "ekf_triplets", "ekf_sigma_px",
                        "ekf_gate", "ekf_iterations", "quiet"});
  command.run = RunCompare;
  return command;
}

}  // namespace camgyro
