#!/usr/bin/python3
"""Calibrates simulated devices that have all effects at once, at sizes drawn from what devices of a
class usually show and declared by nobody, and prints how the errors compare with sigma_total:

    tools/random_devices.py [--device phone|action|industrial] [--seeds A-B] [--duration S]
                            [--motions NAME,...] [--clean] [--diagnose] [--jobs N] [--camgyro PATH]
                            [KEY=VALUE ...]

The sizes are those of the class in estimator/diagnosis/device_class.cc, read from that file. --clean
draws nothing: for how often a doubt is said of a device that has no effect. --diagnose: what
`diagnose` makes of the devices, instead of `calibrate`. KEY=VALUE changes the scenario of all
recordings, as in `camgyro simulate` (scene.moving_objects=2). Prints a table by parameter: part of the
errors within 3 sigma_total, their rms in sigma_total, the median of sigma_total [px, s, rad/s, rad]
and what that is of the spread of the errors, the recordings with errors beyond 3 sigma_total, and
the NEES per parameter with the total covariance.
"""
import argparse
import os
import re
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CLASSES = ("phone", "action", "industrial")


def usual_sizes(device):
    """{effect: standard deviation of each parameter} of a class."""
    with open(SOURCE + "/estimator/diagnosis/device_class.cc", encoding="utf-8") as file:
        rows = re.findall(r'\{"(\w+)",\s*"\w+",\s*\{([^}]*)\}', file.read())
    return {name: float(values.split(",")[CLASSES.index(device)]) for name, values in rows}


def drawn_effects(device, seed):
    """Scenario of a device with an effect of every kind that the simulator has in that form."""
    size, random = usual_sizes(device), np.random.default_rng(seed)

    def draw(name, count=None):
        values = size[name] * random.standard_normal(count)
        return values.tolist() if count else float(values)

    focal_px = 650.0 * float(np.exp(0.1 * random.standard_normal()))
    readout_s = float(random.uniform(0.008, 0.03))
    k = draw("radial_distortion", 2)
    p = draw("tangential_distortion", 2)
    s = draw("gyro_misalignment", 3)
    effects = {
        "gyro_scale": {"error": draw("gyro_scale", 3)},
        "gyro_misalignment": {"xy": s[0], "xz": s[1], "yz": s[2]},
        "radial_distortion": {"k1": k[0], "k2": k[1]},
        "tangential_distortion": {"p1": p[0], "p2": p[1]},
        "aspect_ratio": {"ratio": 1.0 + draw("aspect_ratio")},
        "focal_drift": {"rate_px_s": draw("focal_drift")},
        "clock_skew": {"ppm": draw("clock_skew")},
        # A sine whose rms is the size.
        "delay_wander": {"amplitude_s": float(np.sqrt(2) * size["delay_wander"]), "period_s": 7},
        "readout_nonlinear": {"curve": draw("readout_nonlinear") / readout_s},
        "gyro_lowpass": {"time_constant_s": float(np.sqrt(abs(draw("gyro_lowpass"))))},
        "bias_drift": {"rate_rad_s2": draw("bias_drift", 3)},
        "gyro_g_sensitivity": {"factor_rad_s_m": draw("gyro_g_sensitivity", 3)},
        "exposure_lowpass": {"factor": 1.0},
    }
    camera = {"focal_px": focal_px, "readout_s": readout_s,
              "delay_s": float(random.uniform(-0.1, 0.1)),
              "exposure_s": 0.02}  # of every frame, as in dim light
    return {"camera": camera, "effects": effects}


def run(options, seed):
    motion = options.motions[seed % len(options.motions)]
    scenario = {"seed": seed, "duration_s": options.duration, "motion": {"kind": motion},
                "tracks": {"noise_px": 0.5, "outlier_fraction": 0.02}}
    if not options.clean:
        scenario.update(drawn_effects(options.device, seed))
    with tempfile.TemporaryDirectory() as folder:
        recording, out = folder + "/recording", folder + "/out"
        with open(folder + "/scenario.yaml", "w", encoding="utf-8") as file:
            yaml.safe_dump(scenario, file)
        subprocess.run([options.camgyro, "simulate", folder + "/scenario.yaml", *options.changes,
                        "--out", recording], check=True, stdout=subprocess.DEVNULL)
        command = "diagnose" if options.diagnose else "calibrate"
        done = subprocess.run([options.camgyro, command, recording, "--out", out,
                               "--device", options.device],
                              capture_output=True, text=True, check=False)
        if not os.path.exists(out + "/calibration.yaml"):
            print(seed, motion, "refused:", done.stderr.strip().split("\n")[-1], flush=True)
            return None
        with open(out + "/calibration.yaml", encoding="utf-8") as file:
            calibration = yaml.safe_load(file)
        with open(recording + "/truth.yaml", encoding="utf-8") as file:
            truth = yaml.safe_load(file)
        doubts = ["the pictures show something" in done.stdout,
                  "the two halves of the recording disagree" in done.stdout]
        if not options.clean:
            as_fitted(truth, recording, options.duration)
        error, noise = errors(calibration, truth)
        total = np.array(calibration["covariance"]["total"])
        determined = np.array([name not in calibration["quality"]["unobservable"]
                               for name in calibration["covariance"]["order"]])
        return dict(error=error, noise=noise, total=total, doubts=doubts, determined=determined,
                    name="%s %d" % (motion, seed))


def as_fitted(truth, recording, duration_s):
    """What the effects shift by definition (docs/effects.md): a filter delays the gyro by its time
    constant, a drifting bias is that of the middle, under the mean force."""
    values = {e["name"]: {p["name"]: p["value"] for p in e["parameters"]}
              for e in truth["effects"]}
    truth["clock"]["delay_s"]["value"] += values["gyro_lowpass"]["time_constant"]
    force = np.loadtxt(recording + "/imu0/data.csv", delimiter=",")[:, 4:7].mean(axis=0)
    bias = truth["gyro"]["bias_rad_s"]
    bias["value"] = [
        b + values["bias_drift"]["rate_" + axis] * (0.5 * duration_s + 0.5)
        + values["gyro_g_sensitivity"][axis] * f
        for axis, b, f in zip("xyz", bias["value"], force)]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="phone", choices=CLASSES)
    parser.add_argument("--seeds", default="1-200")
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--motions", default="walking,running,handheld")
    parser.add_argument("--clean", action="store_true")
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE")
    options = parser.parse_args()
    options.motions = options.motions.split(",")
    first, last = (options.seeds.split("-") * 2)[:2]
    seeds = range(int(first), int(last) + 1)
    with ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda seed: run(options, seed), seeds))
    results = [r for r in results if r is not None]
    error = np.array([r["error"] for r in results])
    sigma = np.array([np.sqrt(np.diag(r["total"])) for r in results])
    noise = np.array([r["noise"] for r in results])
    used = np.array([r["determined"] for r in results])
    z = np.where(used, error / sigma, np.nan)
    print("%d of %d devices of class %s%s calibrated; a doubt of the model in %d, of the halves in %d"
          % (len(results), len(seeds), options.device, ", clean" if options.clean else "",
             *np.sum([r["doubts"] for r in results], axis=0)))
    print("| parameter | determined | within 3 sigma_total | rms error in sigma_total | "
          "sigma_total | sigma_total / spread of errors | rms error in sigma of noise |")
    print("| --- " * 7 + "|")
    for i, name in enumerate(NAMES):
        of = used[:, i]
        if not of.any():
            continue
        spread = 1.4826 * np.median(np.abs(error[of, i]))
        print("| %s | %d | %.1f %% | %.2f | %.2g | %.2f | %.1f |" % (
            name, of.sum(), 100 * np.nanmean(np.abs(z[of, i]) < 3), np.sqrt(np.nanmean(z[of, i]**2)),
            np.median(sigma[of, i]), np.median(sigma[of, i]) / spread,
            np.sqrt(np.mean((error[of, i] / noise[of, i])**2))))
    print("| all | %d | %.2f %% | %.2f | | | %.2f |" % (
        used.sum(), 100 * np.mean(np.abs(z[used]) < 3), np.sqrt(np.mean(z[used]**2)),
        np.sqrt(np.mean((error[used] / noise[used])**2))))
    for r, errors_in_sigmas in zip(results, z):
        if np.any(np.abs(errors_in_sigmas) > 3):
            print("beyond 3 sigma_total in %s:" % r["name"], ", ".join(
                "%s %.1f" % pair for pair in zip(NAMES, errors_in_sigmas) if abs(pair[1]) > 3))
    nees = [r["error"] @ np.linalg.solve(r["total"], r["error"]) / len(NAMES) for r in results]
    print("NEES per parameter with the total covariance: mean %.2f, median %.2f" % (
        np.mean(nees), np.median(nees)))


if __name__ == "__main__":
    main()
