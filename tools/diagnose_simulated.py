#!/usr/bin/python3
"""Diagnoses simulated recordings and writes docs/lab/diagnosis_simulated.md: every effect,
undeclared; two effects at once; clean recordings, on which nothing may be named.

    tools/diagnose_simulated.py [--seeds A-B] [--effects NAME,...] [--duration S] [--pairs A-B]
                                [--clean A-B] [--clean_duration S] [--jobs N] [--camgyro PATH]
                                [--write]

Every run becomes a line of docs/lab/diagnosis_simulated.jsonl, with the commit of the sources; a
later run of the same case takes its place. The document is made of all lines, so that a long series can
be run in parts (all of it takes hours): --seeds 1-3 now, --seeds 4-10 later, --seeds 0 for none.
--write only writes the document. Sizes are those of tools/scenarios/effect_*.yaml. The reference is
`calibrate` with the effect declared ("informed"), in the shape that the diagnosis found, if it did.
"""
import argparse
import copy
import glob
import itertools
import json
import os
import random
import subprocess
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np
import yaml

from calibration_errors import errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# They end in a refusal or in words, not in parameters that a fit could be given.
NOT_FITTED = ("electronic_stabilisation", "gyro_saturation", "readout_direction")
# Their scenarios have what no other effect's has.
ALONE = ("translation_acceleration", "attitude_rolling_shutter")
# A walk turns with less than 1 rad/s, so that nothing saturates.
ABSENT = (("gyro_saturation", "walking"),)
MOTIONS = ("walking", "running")


def read(path):
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def as_fitted(truth, duration_s, recording):
    """The truth, with what the effects are said to shift: a gyro's filter delays by its time
    constant, and stamps that are late by some mean latency make the camera seem earlier, both of
    which is part of t_d; the bias is that of the middle if it drifts, and that under the mean
    force if the gyro feels forces."""
    truth = copy.deepcopy(truth)
    values = {e["name"]: {p["name"]: p["value"] for p in e["parameters"]}
              for e in truth["effects"]}
    delay = truth["clock"]["delay_s"]
    delay["value"] += values.get("gyro_lowpass", {}).get("time_constant", 0.0)
    delay["value"] -= values.get("frame_stamp_jitter", {}).get("latency", 0.0)
    if "bias_drift" in values:
        bias = truth["gyro"]["bias_rad_s"]
        margin_s = read(SOURCE + "/tools/scenarios/default.yaml")["margin_s"]
        bias["value"] = [b + values["bias_drift"]["rate_" + axis] * (
            0.5 * duration_s + margin_s) for axis, b in zip("xyz", bias["value"])]
    if "gyro_g_sensitivity" in values:
        bias = truth["gyro"]["bias_rad_s"]
        force = np.loadtxt(recording + "/imu0/data.csv", delimiter=",")[:, 4:7].mean(axis=0)
        bias["value"] = [b + values["gyro_g_sensitivity"][axis] * f
                         for axis, b, f in zip("xyz", bias["value"], force)]
    return truth


def true_parameters(truth, effect):
    """Of an effect, by the names that the fit gives them; those that only one of the two has (the
    curve of a wander, a lens in another shape) are left out."""
    found = [e for e in truth["effects"] if e["name"] == effect]
    values = {p["name"]: p["value"] for e in found for p in e["parameters"]}
    camera, shutter = truth["camera"], truth["shutter"]
    for name, new, convert in (
            ("ratio", "aspect_ratio_change", lambda v: v - 1),
            ("time_constant", "time_constant_sq", lambda v: v * v),
            ("factor", "factor_sq", lambda v: v * v),
            ("gain", "shift_per_rad", lambda v: v * camera["focal_px"]["value"]),
            ("curve", "bend", lambda v: v * shutter["readout_s"]["value"])):
        if name in values:
            values[new] = convert(values[name])
    if values.get("breathing"):
        del values["rate"]  # the fit's line through a focal length that swings is not its trend
    return values


def effect_errors(calibration, truth):
    """Errors of all effects' parameters in their sigmas."""
    errors_in_sigmas = []
    for effect in calibration.get("effects", []):
        values = true_parameters(truth, effect["name"])
        errors_in_sigmas += [(p["value"] - values[p["name"]]) / p["sigma"]
                             for p in effect["parameters"] if p["name"] in values]
    return errors_in_sigmas


def changes_of(scenario):
    """What a scenario file says, as changes on a command line."""
    def flat(prefix, node):
        for key, value in node.items():
            if isinstance(value, dict):
                yield from flat(prefix + key + ".", value)
            else:
                yield prefix + key + "=" + yaml.safe_dump(value, default_flow_style=True,
                                                          width=1000).split("\n")[0]
    return [change for change in flat("", read(scenario))
            if not change.startswith(("duration_s", "tracks.", "motion."))]


def effect_of(scenario):
    """effect_NAME.yaml, or effect_NAME.VARIANT.yaml"""
    return name_of(scenario).split(".")[0]


def name_of(scenario):
    return os.path.basename(scenario)[:-5].replace("effect_", "")


def run(options, case):
    """One recording: simulated, diagnosed and, with effects that a fit can have, calibrated."""
    with tempfile.TemporaryDirectory() as folder:
        recording, out, informed = folder + "/recording", folder + "/out", folder + "/informed"
        subprocess.run([options.camgyro, "simulate", *case["scenario"], "--out", recording],
                       check=True, stdout=subprocess.DEVNULL)
        begin = time.time()
        diagnosed = subprocess.run([options.camgyro, "diagnose", recording, "--out", out,
                                    "--quiet"], capture_output=True, text=True)
        result = dict(case, seconds=time.time() - begin, tested=False, added=[], chi2="",
                      unexplained=False, parameters="", size=None)
        shapes = {}
        if not os.path.exists(out + "/diagnosis.yaml"):
            result["failed"] = diagnosed.stderr.strip().split("\n")[-1]
        else:
            diagnosis = read(out + "/diagnosis.yaml")
            verdict, rounds = diagnosis["verdict"], diagnosis["rounds"]
            result["tested"] = bool(rounds)
            result["unexplained"] = verdict["unexplained_structure"]
            result["unconfirmed"] = verdict.get("unconfirmed", [])
            if rounds:
                # after correction for the number of candidates
                result["least_p"] = min(1.0, len(rounds[0]["candidates"]) * min(
                    c["p_value"] for c in rounds[0]["candidates"]))
                if case["kind"] == "clean":
                    result["p_values"] = {c["name"]: c["p_value"]
                                          for c in rounds[0]["candidates"]}
            rounds = [r for r in rounds if "withdrawn" not in r]
            result["added"] = [r["added"] for r in rounds if r["added"] != "none"]
            for r in rounds:
                if r["added"] != "none":
                    shapes[r["added"]] = r["added"] + ":" + str(r["candidates"][0]["shape"])
            if result["added"]:
                chosen = rounds[0]["candidates"][0]
                result["chi2"] = "%.3f → %.3f" % (rounds[0]["unseen_chi2"]["before"],
                                                  rounds[0]["unseen_chi2"]["after"])
                result["parameters"] = ", ".join(
                    "%s %.3g ± %.2g %s" % (p["name"], p["value"], p["sigma"], p["unit"])
                    for p in chosen.get("parameters", [])[:3])
            # What was found at the start was in the fit before the first round.
            result["added"] += [e for e in verdict["effects"] if e not in result["added"]]
        if case["effects"] and not set(case["effects"]) & set(NOT_FITTED):
            declared = ",".join(shapes.get(effect, effect) for effect in case["effects"])
            subprocess.run([options.camgyro, "calibrate", recording, "--effects", declared,
                            "--out", informed, "--quiet"], capture_output=True, check=False)
        if os.path.exists(informed + "/calibration.yaml"):
            reference = read(informed + "/calibration.yaml")
            truth = as_fitted(read(recording + "/truth.yaml"), options.duration, recording)
            sizes = [max((abs(p["value"]) / p["sigma"] for p in e["parameters"] if p["sigma"] > 0),
                         default=None) for e in reference.get("effects", [])]
            result["size"] = None if None in sizes or not sizes else min(sizes)
            if os.path.exists(out + "/calibration.yaml"):
                error, sigma = errors(reference, truth)
                result["error_informed"] = np.nanmean((error / sigma)**2)  # attitudes have no lens
                calibration = read(out + "/calibration.yaml")
                error, _ = errors(calibration, truth)
                result["error_found"] = np.nanmean((error / sigma)**2)
                if result["added"][:1] == case["effects"][:1]:
                    result["effect_errors"] = effect_errors(calibration, truth)
    print(case["name"], case["motion"], case["seed"], result["added"], result["parameters"],
          "unexplained" if result["unexplained"] else "", result.get("failed", ""),
          "%.0f s" % result["seconds"], flush=True)
    return result


def effect_cases(options):
    # One seed after the other, so that a series that is cut off has all effects.
    scenarios = sorted(glob.glob(SOURCE + "/tools/scenarios/effect_*.yaml"))
    for seed, scenario, motion in itertools.product(options.seeds, scenarios, MOTIONS):
        wanted = not options.effects or name_of(scenario) in options.effects
        if wanted and (name_of(scenario), motion) not in ABSENT:
            yield dict(kind="effects", name=name_of(scenario), motion=motion, seed=seed,
                       effects=[effect_of(scenario)],
                       scenario=[scenario, "seed=%d" % seed, "duration_s=%g" % options.duration,
                                 "motion.kind=" + motion])


def pair_cases(options):
    scenarios = [s for s in sorted(glob.glob(SOURCE + "/tools/scenarios/effect_*.yaml"))
                 if name_of(s) not in NOT_FITTED + ALONE
                 and name_of(s) == effect_of(s)]
    pairs = list(itertools.combinations(scenarios, 2))
    random.Random(1).shuffle(pairs)
    for seed, (a, b) in enumerate(pairs, 1):
        if seed not in options.pairs:
            continue
        motion = MOTIONS[seed % len(MOTIONS)]
        yield dict(kind="pairs", name=name_of(a) + " + " + name_of(b), motion=motion, seed=seed,
                   effects=[name_of(a), name_of(b)],
                   scenario=[a, *changes_of(b), "seed=%d" % seed,
                             "duration_s=%g" % options.duration, "motion.kind=" + motion])


def clean_cases(options):
    """All motions, 0.2 to 1 px, up to 15 % outliers, moving points, dropped frames and samples."""
    motions = ("walking", "running", "handheld", "slow", "panning", "rotation")
    variants = ((), ("scene.moving_fraction=0.1",), ("camera.drop_fraction=0.02",),
                ("gyro.drop_fraction=0.01",), ("camera.exposure_swing=0.5",))
    noises, outliers = (0.2, 0.5, 1.0), (0.0, 0.05, 0.15)
    for seed in options.clean:
        motion, variant = motions[seed % 6], variants[seed % 5]
        noise, wrong = noises[(seed // 6) % 3], outliers[(seed // 18) % 3]
        yield dict(kind="clean", name="clean", motion=motion, seed=seed, effects=[],
                   variant=" ".join((variant or ("plain",)) + ("%g px, %g %% outliers" % (
                       noise, 100 * wrong),)),
                   scenario=[SOURCE + "/tools/scenarios/motion_%s.yaml" % motion,
                             "seed=%d" % (1000 + seed), "duration_s=%g" % options.clean_duration,
                             "tracks.noise_px=%g" % noise, "tracks.outlier_fraction=%g" % wrong,
                             *variant])


def count(names):
    return "; ".join("%s (%d)" % item
                     for item in sorted(Counter(name or "nothing" for name in names).items()))


def ratio_of(rows):
    rows = [r for r in rows if "error_found" in r]
    if not rows:
        return "-"
    return "%.2f" % np.sqrt(np.median([r["error_found"] / r["error_informed"] for r in rows]))


def write_effects(out, results):
    out.write("First: runs in which the right effect was the first added. Size: of the effect in "
              "sigmas of its informed fit (largest parameter, median of the runs); below 3 it "
              "cannot be told from noise. Errors: of the calibration, rms in sigmas, over those of "
              "the informed one (median of the runs). Within 3σ: parameters of the effect, where "
              "it was found and has a true value to compare with, in the final calibration.\n\n")
    out.write("| Effect | Motion | First | Named | Unexplained | Size | Errors | Within 3σ | "
              "Found (first seed) | Unseen chi2/dof (first seed) | Seconds |\n"
              "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n")
    keys = sorted(set((r["name"], r["motion"]) for r in results),
                  key=lambda key: (key[0], MOTIONS.index(key[1])))
    for name, motion in keys:
        rows = [r for r in results if (r["name"], r["motion"]) == (name, motion)]
        sizes = [r["size"] for r in rows if r["size"] is not None]
        out.write("| %s | %s | %d of %d | %s | %d | %s | %s | %s | %s | %s | %.0f |\n" % (
            name, motion, sum(map(is_right, rows)), len(rows),
            count(", ".join(r["added"]) for r in rows), sum(r["unexplained"] for r in rows),
            "%.1f" % np.median(sizes) if sizes else "-", ratio_of(rows), within(rows),
            rows[0]["parameters"], rows[0]["chi2"], np.mean([r["seconds"] for r in rows])))
    large = [r for r in results if r["size"] is not None and r["size"] >= 3]
    worse = [r for r in large if "error_found" in r and
             r["error_found"] > 1.3**2 * r["error_informed"]]
    out.write("\nThe right effect is the first added in %d of %d runs; of those whose effect has "
              "a size of 3 or more, in %d of %d. Of these, the calibration's errors are beyond 1.3 "
              "times those of the informed one in %d. Within 3σ are %s of the effects' parameters."
              "\n\n" % (sum(map(is_right, results)), len(results), sum(map(is_right, large)),
                        len(large), len(worse), within(results)))
    write_confirmed(out, results)
    for motion in MOTIONS:
        informed = [r["error_informed"] for r in results
                    if r["motion"] == motion and "error_informed" in r]
        if informed:
            out.write("Squared errors of the informed calibrations, in sigmas, have a mean of %.2f "
                      "in %d recordings of %s (honest sigmas: 1).\n" % (
                          np.mean(informed), len(informed), motion))
    out.write("\n")


def write_confirmed(out, results):
    """Of runs whose verdict says what frames that had no part in it do not confirm."""
    of = [r for r in results if "unconfirmed" in r and r["tested"]]
    for kind, right in (("right", True), ("wrong", False)):
        names = [(n, r) for r in of for n in r["added"] if (n in r["effects"]) == right]
        not_confirmed = sum(n in r["unconfirmed"] for n, r in names)
        out.write("Of %d effects that were named and are %s, the frames of the report share do not "
                  "confirm %d.\n" % (len(names), kind, not_confirmed))
    out.write("\n")


def within(rows):
    all_errors = [e for r in rows for e in r.get("effect_errors", [])]
    return "%d of %d" % (sum(abs(e) < 3 for e in all_errors),
                         len(all_errors)) if all_errors else "-"


def is_right(row):
    return row["added"][:1] == row["effects"]


def write_pairs(out, results):
    out.write("Pairs at random of the effects that have parameters, one run each. Size: of the "
              "smaller one; a delay_step that was not found has no time to fit it at, and no size."
              "\n\n| Effects | Motion | Added | Both | Unexplained | Size | Errors |\n"
              "| --- | --- | --- | --- | --- | --- | --- |\n")
    both, small = 0, 0
    for r in results:
        found = set(r["effects"]) <= set(r["added"])
        both += found
        small += r["size"] is not None and r["size"] < 3
        out.write("| %s | %s | %s | %s | %s | %s | %s |\n" % (
            r["name"], r["motion"], ", ".join(r["added"]) or r.get("failed") or "nothing",
            "yes" if found else "no", "yes" if r["unexplained"] else "no",
            "-" if r["size"] is None else "%.1f" % r["size"], ratio_of([r])))
    out.write("\nBoth are found in %d of %d runs; in %d runs one has a size below 3.\n\n" %
              (both, len(results), small))


def write_clean(out, results):
    wrong = [r for r in results if r["added"] or r["unexplained"]]
    failed = [r for r in results if not r["tested"]]
    below = [sum(r["tested"] and r["least_p"] < p for r in results) for p in (0.1, 0.01)]
    out.write("Walking, running, handheld, slow, panning and rotation in turn; 0.2, 0.5 and 1 px; "
              "no, 5 and 15 %% wrong observations; moving points, dropped frames, dropped samples, "
              "changing exposure. In %d of %d recordings an effect is named or structure reported; "
              "%d could not be tested, and say nothing. The smallest p of all candidates, corrected "
              "for their number, is below 0.1 in %d and below 0.01 in %d of them (by chance: up to "
              "%.0f and %.0f).\n\n" % (
                  len(wrong), len(results), len(failed), *below, 0.1 * len(results),
                  0.01 * len(results)))
    for r in wrong + failed:
        out.write("- %s, seed %d (%s): %s%s\n" % (
            r["motion"], r["seed"], r["variant"],
            ", ".join(r["added"]) or r.get("failed", "" if r["tested"] else "not tested"),
            " unexplained structure" if r["unexplained"] else ""))
    if wrong or failed:
        out.write("\n")
    write_p_values(out, [r["p_values"] for r in results if "p_values" in r])


def write_p_values(out, recordings):
    """How often each candidate's own p-value is small where nothing is wrong."""
    names = sorted({name for p_values in recordings for name in p_values})
    if not names:
        return
    out.write("Share of recordings in which the p-value of a candidate, not corrected for their "
              "number, is below 0.5, 0.1, 0.05 and 0.01.\n\n"
              "| Candidate | Recordings | < 0.5 | < 0.1 | < 0.05 | < 0.01 |\n"
              "| --- | --- | --- | --- | --- | --- |\n")
    for name in names:
        p = np.array([p_values[name] for p_values in recordings if name in p_values])
        out.write("| %s | %d | %s |\n" % (name, len(p), " | ".join(
            "%.3f" % np.mean(p < limit) for limit in (0.5, 0.1, 0.05, 0.01))))
    out.write("\n")


def write(options, results):
    with open(options.out + ".new", "w", encoding="utf-8") as out:
        out.write("# The diagnosis of simulated recordings\n\nMade by "
                  "`tools/diagnose_simulated.py`; every run is a line of "
                  "diagnosis_simulated.jsonl.\n\n")
        for kind, (title, section) in SECTIONS.items():
            chosen = sorted((r for r in results if r["kind"] == kind),
                            key=lambda r: (r["name"] if kind == "effects" else "", r["seed"]))
            if not chosen:
                continue
            commits = Counter((r["commit"], r["duration_s"]) for r in chosen)
            out.write("## %s\n\nRecordings of %g s: %s.\n\n" % (
                title, chosen[0]["duration_s"],
                ", ".join("%d with commit %s" % (n, commit)
                          for (commit, _), n in commits.most_common())))
            section(out, chosen)
    os.replace(options.out + ".new", options.out)


SECTIONS = {"effects": ("One effect", write_effects),
            "pairs": ("Two effects at once", write_pairs),
            "clean": ("Clean recordings", write_clean)}


def numbers(text):
    """1-10: these, both included; 3: the first three; 0: none"""
    first, _, last = text.rpartition("-")
    return range(int(first or 1), int(last) + 1)


def commit_of_sources():
    """The last one that changed more than documents."""
    def git(*words):
        return subprocess.run(["git", "-C", SOURCE, *words, "--", ".", ":!docs"], check=True,
                              capture_output=True, text=True).stdout.strip()
    return git("log", "-1", "--format=%h") + ("+" if git("status", "--porcelain") else "")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=numbers, default="10")
    parser.add_argument("--effects", type=lambda names: names.split(","))
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--pairs", type=numbers, default="20")
    parser.add_argument("--clean", type=numbers, default="200")
    parser.add_argument("--clean_duration", type=float, default=14.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--out", default=SOURCE + "/docs/lab/diagnosis_simulated.md")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    store = os.path.splitext(options.out)[0] + ".jsonl"
    results = {}
    if os.path.exists(store):
        with open(store, encoding="utf-8") as lines:
            results = {key_of(row): row for row in map(json.loads, lines)}
    commit = commit_of_sources()
    cases = [] if options.write else [*effect_cases(options), *pair_cases(options),
                                      *clean_cases(options)]
    with ThreadPoolExecutor(options.jobs) as pool:
        for done in as_completed([pool.submit(run, options, case) for case in cases]):
            row = dict(done.result(), commit=commit, duration_s=(
                options.clean_duration if done.result()["kind"] == "clean" else options.duration))
            del row["scenario"]
            results[key_of(row)] = row
            with open(store + ".new", "w", encoding="utf-8") as out:
                for key in sorted(results):
                    out.write(json.dumps(rounded(results[key])) + "\n")
            os.replace(store + ".new", store)
    write(options, list(results.values()))


def rounded(value):
    """To four digits, all numbers in a row."""
    if isinstance(value, float):
        return float("%.4g" % value)
    if isinstance(value, list):
        return [rounded(item) for item in value]
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return value


def key_of(row):
    return row["kind"], row["name"], row["motion"], row["seed"]


if __name__ == "__main__":
    main()
