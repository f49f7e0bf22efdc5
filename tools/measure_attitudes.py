#!/usr/bin/python3
"""Prints the tables of docs/lab/attitudes.md: what structure from motion makes of the rows of a rolling
shutter if it takes all for one time, and how right calibrations of simulated attitudes are.

    tools/measure_attitudes.py [--seeds N] [--camgyro PATH]
"""
import argparse
import os
import subprocess
import tempfile

import numpy as np
import yaml

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OF_ATTITUDES = slice(4, 11)  # of NAMES: delay, bias, mounting
EFFECT = {"roll_by_yaw": -0.004, "yaw_by_roll": 0.003}  # [s]


def shown_rotation(width, height, readout, relief):
    """How an attitude is off, by the camera's rate about x, y, z [s], (3, 3): least squares of six
    degrees of freedom to what rows add that are read `readout` seconds from the first to the last.

    width, height: of the picture, in focal lengths. relief: spread of 1 / depth over its mean."""
    x, y = [grid.ravel() for grid in np.meshgrid(np.linspace(-0.5, 0.5, 41) * width,
                                                 np.linspace(-0.5, 0.5, 31) * height)]
    near = 1 + relief * np.random.default_rng(0).standard_normal(x.size)
    turned = [np.concatenate(field) for field in ((x * y, 1 + y * y), (-1 - x * x, -x * y), (y, -x))]
    moved = [np.concatenate(field) for field in ((-near, 0 * x), (0 * x, -near), (x * near, y * near))]
    late = readout / height * np.concatenate([y, y])
    unknowns = np.stack(turned + moved, axis=1)
    return np.stack([np.linalg.lstsq(unknowns, late * field, rcond=None)[0][:3]
                     for field in turned], axis=1)


def print_rolling():
    print("| Picture [focal lengths] | Spread of 1 / depth | Roll by yaw [ms] | Yaw by roll [ms] | "
          "Largest other [ms] |\n| --- | --- | --- | --- | --- |")
    for width, height in ((1.1, 0.82), (1.1, 0.62), (0.82, 1.1)):
        for relief in (0, 0.1, 0.3):
            shown = 1e3 * shown_rotation(width, height, 0.033, relief)
            roll_by_yaw, yaw_by_roll = shown[2, 1], shown[1, 2]
            shown[2, 1] = shown[1, 2] = 0
            print("| %.2f x %.2f | %.0f %% | %.1f | %.1f | %.1f |" % (
                width, height, 100 * relief, roll_by_yaw, yaw_by_roll, np.abs(shown).max()))


def run(camgyro, motion, seed, changes):
    """Errors in sigmas of delay, bias and mounting (7), of the effect's parameters (none or 2), the
    delay's error and sigma [s], and what diagnose named."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([camgyro, "simulate", SOURCE + "/tools/scenarios/motion_%s.yaml" % motion,
                        "duration_s=40", "gyro.rate_hz=100", "seed=%d" % seed, *changes,
                        "--out", folder + "/r"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([camgyro, "diagnose", folder + "/r", "--out", folder + "/o", "--quiet"],
                       check=True, stdout=subprocess.DEVNULL)
        with open(folder + "/o/calibration.yaml", encoding="utf-8") as file:
            found = yaml.safe_load(file)
        with open(folder + "/r/truth.yaml", encoding="utf-8") as file:
            truth = yaml.safe_load(file)
        with open(folder + "/o/diagnosis.yaml", encoding="utf-8") as file:
            verdict = yaml.safe_load(file)["verdict"]
    error, sigma = errors(found, truth)
    effect = [(p["value"] - EFFECT[p["name"]]) / p["sigma"] for e in found.get("effects") or []
              if e["name"] == "attitude_rolling_shutter" for p in e["parameters"]]
    named = list(verdict["effects"]) + ["structure"] * bool(verdict["unexplained_structure"])
    at = NAMES.index("t_d")
    return (error / sigma)[OF_ATTITUDES], effect, error[at], sigma[at], named


def print_simulated(camgyro, seeds):
    print("| Motion | Attitudes | Effect | Named | t_d: rms error, mean sigma [ms] | "
          "Mean squared error [sigma^2] | The effect's, largest [sigma] |\n"
          "| --- | --- | --- | --- | --- | --- | --- |")
    for motion in ("walking", "running"):
        for noise, mrad, with_effect in (("walk", 0.2, False), ("walk", 0.8, False),
                                         ("walk", 0.8, True), ("noise", 0.6, False)):
            changes = ["attitudes.%s_rad=%g" % (noise, 1e-3 * mrad)]
            if with_effect:
                changes += ["effects.attitude_rolling_shutter.%s_s=%g" % item
                            for item in EFFECT.items()]
            runs = [run(camgyro, motion, seed, changes) for seed in range(1, seeds + 1)]
            named = sorted(name for r in runs for name in r[4])
            print("| %s | %s %.1f mrad | %s | %s | %.3f, %.3f | %.2f | %s |" % (
                motion, noise, mrad, "yes" if with_effect else "no",
                ", ".join("%s (%d of %d)" % (name, named.count(name), seeds)
                          for name in sorted(set(named))) or "nothing",
                1e3 * np.sqrt(np.mean([r[2]**2 for r in runs])), 1e3 * np.mean([r[3] for r in runs]),
                np.mean([r[0]**2 for r in runs]),
                "%.1f" % max(abs(e) for r in runs for e in r[1]) if any(r[1] for r in runs) else "-"),
                flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    options = parser.parse_args()
    print_rolling()
    print()
    print_simulated(options.camgyro, options.seeds)


if __name__ == "__main__":
    main()
