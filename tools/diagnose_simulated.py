#!/usr/bin/python3
"""Diagnoses simulated recordings and writes docs/diagnosis_simulated.md: every effect, undeclared;
two effects at once; clean recordings, on which nothing may be named.

    tools/diagnose_simulated.py [--seeds N] [--duration S] [--motions walking,running] [--pairs N]
                                [--clean N] [--clean_duration S] [--jobs N] [--camgyro PATH]

With --seeds 0, --pairs 0 or --clean 0 that section of the document stays as it is. Sizes are those
of tools/scenarios/effect_*.yaml. The reference is `calibrate` with the effect declared
("informed"), in the shape that the diagnosis found, if it did.
"""
import argparse
import glob
import itertools
import os
import random
import subprocess
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np
import yaml

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# They end in a refusal or in words, not in parameters that a fit could be given.
NOT_FITTED = ("electronic_stabilisation", "gyro_saturation", "readout_direction")


def read(path):
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def multiply(a, b):
    (w, x, y, z), (p, q, r, s) = a, b
    return np.array([w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r,
                     w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p])


def errors(calibration, truth):
    """Errors of f, c, t_r, t_d, b_g, q_c (3) and their sigmas."""
    def parts(c, key):
        return [c["camera"]["focal_px"][key], *c["camera"]["principal_px"][key],
                c["shutter"]["readout_s"][key], c["clock"]["delay_s"][key],
                *c["gyro"]["bias_rad_s"][key]]
    inverse = np.array(truth["extrinsics"]["q_gyro_cam_wxyz"]["value"]) * [1, -1, -1, -1]
    rotation = multiply(inverse, calibration["extrinsics"]["q_gyro_cam_wxyz"]["value"])
    rotation = 2 * rotation[1:] * np.sign(rotation[0])
    return (np.append(np.subtract(parts(calibration, "value"), parts(truth, "value")), rotation),
            np.append(parts(calibration, "sigma"),
                      calibration["extrinsics"]["q_gyro_cam_wxyz"]["sigma_rad"]))


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
            else:
                result["added"] = verdict["effects"]
        if case["effects"] and not set(case["effects"]) & set(NOT_FITTED):
            declared = ",".join(shapes.get(effect, effect) for effect in case["effects"])
            subprocess.run([options.camgyro, "calibrate", recording, "--effects", declared,
                            "--out", informed, "--quiet"], capture_output=True, check=False)
        if os.path.exists(informed + "/calibration.yaml"):
            reference, truth = read(informed + "/calibration.yaml"), read(recording +
                                                                          "/truth.yaml")
            sizes = [max((abs(p["value"]) / p["sigma"] for p in e["parameters"] if p["sigma"] > 0),
                         default=None) for e in reference.get("effects", [])]
            result["size"] = None if None in sizes or not sizes else min(sizes)
            if os.path.exists(out + "/calibration.yaml"):
                error, sigma = errors(reference, truth)
                result["error_informed"] = np.mean((error / sigma)**2)
                error, _ = errors(read(out + "/calibration.yaml"), truth)
                result["error_found"] = np.mean((error / sigma)**2)
    print(case["name"], case["motion"], case["seed"], result["added"], result["parameters"],
          "unexplained" if result["unexplained"] else "", result.get("failed", ""),
          "%.0f s" % result["seconds"], flush=True)
    return result


def motions_of(options):
    return options.motions.split(",")


def effect_cases(options):
    for scenario in sorted(glob.glob(SOURCE + "/tools/scenarios/effect_*.yaml")):
        for motion, seed in itertools.product(motions_of(options), range(1, options.seeds + 1)):
            yield dict(kind="effects", name=name_of(scenario), motion=motion, seed=seed,
                       effects=[effect_of(scenario)],
                       scenario=[scenario, "seed=%d" % seed, "duration_s=%g" % options.duration,
                                 "motion.kind=" + motion])


def pair_cases(options):
    scenarios = [s for s in sorted(glob.glob(SOURCE + "/tools/scenarios/effect_*.yaml"))
                 if name_of(s) not in NOT_FITTED + ("translation_acceleration",)
                 and name_of(s) == effect_of(s)]
    pairs = list(itertools.combinations(scenarios, 2))
    random.Random(1).shuffle(pairs)
    for seed, (a, b) in enumerate(pairs[:options.pairs], 1):
        motion = motions_of(options)[seed % len(motions_of(options))]
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
    for seed in range(1, options.clean + 1):
        motion, variant = motions[seed % 6], variants[seed % 5]
        noise, wrong = noises[(seed // 6) % 3], outliers[(seed // 18) % 3]
        yield dict(kind="clean", name="clean", motion=motion, seed=seed, effects=[],
                   variant=" ".join((variant or ("plain",)) + ("%g px, %g %% outliers" % (
                       noise, 100 * wrong),)),
                   scenario=[SOURCE + "/tools/scenarios/default.yaml", "seed=%d" % (1000 + seed),
                             "duration_s=%g" % options.clean_duration, "motion.kind=" + motion,
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


def write_effects(out, options, results):
    out.write("`--seeds %d --duration %g --motions %s`. First: runs in which the "
              "right effect was the first added. Size: of the effect in sigmas of its informed fit "
              "(largest parameter, median of the runs); below 3 it cannot be told from noise. "
              "Errors: of the calibration, rms in sigmas, over those of the informed one (median "
              "of the runs).\n\n" % (options.seeds, options.duration, options.motions))
    out.write("| Effect | Motion | First | Named | Unexplained | Size | Errors | Found (first "
              "seed) | Unseen chi2/dof (first seed) | Seconds |\n"
              "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n")
    keys = list(dict.fromkeys((r["name"], r["motion"]) for r in results))
    right, identifiable, right_of_identifiable = 0, 0, 0
    for name, motion in keys:
        rows = [r for r in results if (r["name"], r["motion"]) == (name, motion)]
        first = [r["added"][:1] == r["effects"] for r in rows]
        sizes = [r["size"] for r in rows if r["size"] is not None]
        size = np.median(sizes) if sizes else None
        right += sum(first)
        if size is not None and size >= 3:
            identifiable += len(rows)
            right_of_identifiable += sum(first)
        out.write("| %s | %s | %d of %d | %s | %d | %s | %s | %s | %s | %.0f |\n" % (
            name, motion, sum(first), len(rows), count(", ".join(r["added"]) for r in rows),
            sum(r["unexplained"] for r in rows), "-" if size is None else "%.1f" % size,
            ratio_of(rows), rows[0]["parameters"], rows[0]["chi2"],
            np.mean([r["seconds"] for r in rows])))
    out.write("\nThe right effect is the first added in %d of %d runs; of those whose size is 3 or "
              "more, in %d of %d.\n\n" % (right, len(results), right_of_identifiable,
                                          identifiable))


def write_pairs(out, options, results):
    out.write("`--pairs %d --duration %g`: pairs at random of the effects that have parameters, "
              "one run each. Size: of the smaller one; a delay_step that was not found has no time "
              "to fit it at, and no size.\n\n| Effects | Motion | Added | Both | "
              "Unexplained | Size | Errors |\n| --- | --- | --- | --- | --- | --- | --- |\n" %
              (options.pairs, options.duration))
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


def write_clean(out, options, results):
    wrong = [r for r in results if r["added"] or r["unexplained"]]
    failed = [r for r in results if not r["tested"]]
    out.write("`--clean %d --clean_duration %g`: walking, running, handheld, slow, panning and "
              "rotation in turn; 0.2, 0.5 and 1 px; no, 5 and 15 %% wrong observations; moving "
              "points, dropped frames, dropped samples, changing exposure. In %d of %d recordings "
              "an effect is named or structure reported; %d could not be tested, and say nothing."
              "\n\n" % (options.clean, options.clean_duration, len(wrong), len(results),
                        len(failed)))
    for r in wrong + failed:
        out.write("- %s, seed %d (%s): %s%s\n" % (
            r["motion"], r["seed"], r["variant"],
            ", ".join(r["added"]) or r.get("failed", "" if r["tested"] else "not tested"),
            " unexplained structure" if r["unexplained"] else ""))
    if wrong or failed:
        out.write("\n")


def write(options, cases, results):
    results = sorted(results, key=lambda r: cases.index((r["kind"], r["name"], r["motion"],
                                                         r["seed"])))
    with open(options.out + ".new", "w", encoding="utf-8") as out:
        out.write("# The diagnosis of simulated recordings\n\nMade by "
                  "`tools/diagnose_simulated.py` with the options that each section names.\n\n")
        for kind, (title, section) in SECTIONS.items():
            chosen = [r for r in results if r["kind"] == kind]
            if chosen:
                out.write("## " + title + "\n\n")
                section(out, options, chosen)
            elif title in options.kept:
                out.write("## " + title + "\n" + options.kept[title])
    os.replace(options.out + ".new", options.out)


SECTIONS = {"effects": ("One effect", write_effects),
            "pairs": ("Two effects at once", write_pairs),
            "clean": ("Clean recordings", write_clean)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--motions", default="walking,running")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--clean_duration", type=float, default=14.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--out", default=SOURCE + "/docs/diagnosis_simulated.md")
    options = parser.parse_args()
    options.kept = {}
    if os.path.exists(options.out):
        with open(options.out, encoding="utf-8") as file:
            for section in file.read().split("\n## ")[1:]:
                title, _, text = section.partition("\n")
                options.kept[title] = text.rstrip("\n") + "\n\n"
    cases = [*effect_cases(options), *pair_cases(options), *clean_cases(options)]
    order = [(c["kind"], c["name"], c["motion"], c["seed"]) for c in cases]
    results = []
    with ThreadPoolExecutor(options.jobs) as pool:
        for done in as_completed([pool.submit(run, options, case) for case in cases]):
            results.append(done.result())
            write(options, order, results)


if __name__ == "__main__":
    main()
