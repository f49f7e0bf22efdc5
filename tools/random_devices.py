#!/usr/bin/python3
"""Calibrates simulated devices that have all effects at once, at sizes drawn from what devices of a
class usually show and declared by nobody, and prints how the errors compare with sigma_total:

    tools/random_devices.py [--device phone|action|industrial] [--seeds A-B] [--duration S]
                            [--motions NAME,...] [--clean] [--strange] [--rendered] [--attitudes]
                            [--undeclared] [--diagnose] [--effects LIST] [--stream PREPARE_VIO]
                            [--jobs N] [--camgyro PATH] [KEY=VALUE ...]

The sizes are those of the class in core/effects/device_class.cc, read from that file. --clean draws
nothing: for how often a doubt is said of a device that has no effect. --strange also draws how each
was recorded: motion, length, rates, size of the picture, mounting, stamps of arrival, samples and
frames that are missing, wrong, few and short-lived tracks, and things that move. --rendered: video
of a scene, light and compression that are drawn instead of tracks. --attitudes: attitudes with
errors that add up from frame to frame instead of tracks, made from rows of a rolling shutter, and
a gyro of 100 Hz; what needs pixels is not determined then. --undeclared: the recording does not say
how noisy its gyro is. --diagnose: what `diagnose` makes of the devices, instead of `calibrate`, and
what it names. --effects: to be fitted as well. --stream: what the library's Calibrator makes of
them, frame by frame, with that program (examples/recording); of phones only. KEY=VALUE changes the
scenario of all recordings, as in `camgyro simulate` (scene.moving_objects=2). Prints a table by
parameter: part of the errors within 3 sigma_total, their rms in sigma_total, the medians of
sigma_total and of the errors' size (times 1.48, the spread) [px, s, rad/s, rad] and their ratio,
the recordings with errors beyond 3 sigma_total (or, with --clean, beyond 4 sigmas of noise), and
the NEES per parameter with the total covariance.
"""
import argparse
import os
import re
import subprocess
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml

from calibration_errors import NAMES, errors
from measure_stamps import MOTIONS, arrivals_s

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CLASSES = ("phone", "action", "industrial")


def usual_sizes(device):
    """{effect: standard deviation of each parameter} of a class."""
    with open(SOURCE + "/core/effects/device_class.cc", encoding="utf-8") as file:
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


def drawn_attitudes(device, seed, scenario):
    """Changes a scenario to one of attitudes, which do not model the camera's rolling shutter."""
    size = usual_sizes(device)["attitude_rolling_shutter"]
    scenario["attitudes"] = {"walk_rad": 8e-4}
    scenario["gyro"] = {"rate_hz": 100}
    if "effects" in scenario:
        roll_by_yaw, yaw_by_roll = size * np.random.default_rng([seed, 3]).standard_normal(2)
        scenario["effects"]["attitude_rolling_shutter"] = {
            "roll_by_yaw_s": float(roll_by_yaw), "yaw_by_roll_s": float(yaw_by_roll)}


def drawn_conditions(seed, scenario):
    """Changes a scenario to one that a stranger may have recorded."""
    random = np.random.default_rng([seed, 1])

    def often(probability):
        return random.uniform() < probability

    def log_uniform(low, high):
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    scenario["duration_s"] = log_uniform(8, 40)
    scenario["motion"] = {"kind": str(random.choice(MOTIONS))}
    camera = scenario.setdefault("camera", {})
    width, height = [(640, 480), (1280, 720), (1920, 1080), (720, 480)][random.integers(4)]
    camera["resolution"] = [width, height]
    # From 50 to 85 degrees across.
    camera["focal_px"] = float(0.5 * width / np.tan(np.radians(random.uniform(25, 42.5))))
    camera["rate_hz"] = float(random.choice([15, 20, 24, 30, 30, 60]))
    camera["readout_s"] = float(random.uniform(0.2, 0.95) * min(0.033, 1 / camera["rate_hz"])
                                * (-1 if often(0.2) else 1))
    camera["exposure_s"] = min(camera.get("exposure_s", 0.005), 0.5 / camera["rate_hz"])
    camera["delay_s"] = float(random.uniform(-0.3, 0.3))
    camera["drop_fraction"] = log_uniform(0.005, 0.1) if often(0.3) else 0.0
    # One of the turns that put axes on axes, and some degrees.
    axes = random.integers(-1, 2, 4).astype(float)
    while axes @ axes not in (1, 2, 4):
        axes = random.integers(-1, 2, 4).astype(float)
    wxyz = axes / np.linalg.norm(axes) + random.normal(0, 0.02, 4)
    scenario["mount"] = {"q_gyro_cam_wxyz": (wxyz / np.linalg.norm(wxyz)).tolist()}
    gyro = scenario["gyro"] = {
        "rate_hz": float(random.choice([50, 100, 200, 200, 400])),
        "bias_rad_s": random.normal(0, 0.02, 3).tolist(),
        "quantum_rad_s": float(random.choice([0.0, 0.0, 0.001])),
        "averaged": bool(often(0.5)),
        "noise_density_rad_s_rtHz": log_uniform(5e-5, 1e-3)}
    stamps = random.integers(3)
    if stamps == 1:
        gyro["drop_fraction"] = log_uniform(0.001, 0.05)
    elif stamps == 2:
        gyro["stamp_latency_s"] = log_uniform(0.0005, 0.01)
    effects = scenario.setdefault("effects", {})
    if often(0.4):
        effects["frame_stamp_jitter"] = {"latency_s": log_uniform(0.0005, 0.005)}
    scenario["tracks"] = {
        "noise_px": log_uniform(0.1, 0.8), "noise_scatter": float(random.choice([0.0, 0.3])),
        "count": int(log_uniform(40, 200)), "reanchored": bool(often(0.5)),
        "outlier_fraction": log_uniform(0.005, 0.1),
        "mean_life_frames": float(random.choice([0, 12, 40]))}
    scenario["scene"] = {"kind": "points"}
    if often(0.3):
        scenario["scene"]["moving_fraction"] = float(random.uniform(0.03, 0.2))
    return "%s, %.0f s at %g and %g Hz" % (
        scenario["motion"]["kind"], scenario["duration_s"], camera["rate_hz"], gyro["rate_hz"])


def drawn_pictures(seed, scenario):
    """Changes a scenario to one of video, and says what it shows."""
    random = np.random.default_rng([seed, 2])
    kind = str(random.choice(["room", "facade", "ground", "mountains"]))
    scenario["scene"] = {"kind": kind}
    if kind != "mountains" and random.uniform() < 0.3:
        scenario["scene"]["moving_objects"] = int(random.integers(1, 5))
    motion = scenario["motion"]
    if kind == "room":
        if motion["kind"] != "rotation":
            motion.update(path_radius_m=1.5, speed_m_s=float(random.uniform(0.3, 1)),
                          heading_deg=60)
    else:  # along the wall
        motion["heading_deg"] = float(random.uniform(70, 110 if kind == "facade" else 180))
    scenario["duration_s"] = min(scenario["duration_s"], 12.0)  # rendering takes long
    camera = scenario.setdefault("camera", {})
    width, height = camera.get("resolution", [720, 480])
    if width > 720:
        camera["focal_px"] *= 640 / width
        camera["resolution"] = [640, 640 * height // width]
    camera["exposure_swing"] = float(random.choice([0.0, 0.3]))
    scenario["video"] = {
        "format": "mp4", "crf": int(random.integers(14, 34)),
        "full_well_electrons": float(np.exp(random.uniform(np.log(300), np.log(20000)))),
        "vignetting": float(random.uniform(0, 0.6))}
    return kind


def latency_s(scenario):
    """What stamps of arrival make of the delay: a gyro whose median stamp is on time, and a camera
    whose mean stamp is, have none (docs/recording_format.md)."""
    gyro = scenario.get("gyro", {})
    median_s = 0.0
    if "stamp_latency_s" in gyro:
        median_s = float(np.median(arrivals_s(gyro["stamp_latency_s"], 0.0, gyro["rate_hz"], 200000,
                                              np.random.default_rng(1))))
    jitter = scenario.get("effects", {}).get("frame_stamp_jitter", {})
    return median_s - jitter.get("latency_s", 0.0)


def run(options, seed):
    motion = options.motions[seed % len(options.motions)]
    scenario = {"seed": seed, "duration_s": options.duration, "motion": {"kind": motion},
                "tracks": {"noise_px": 0.5, "outlier_fraction": 0.02}}
    if not options.clean:
        scenario.update(drawn_effects(options.device, seed))
    if options.strange:
        motion = drawn_conditions(seed, scenario)
    if options.rendered:
        motion += ", " + drawn_pictures(seed, scenario)
    if options.attitudes:
        drawn_attitudes(options.device, seed, scenario)
    with tempfile.TemporaryDirectory() as folder:
        recording, out = folder + "/recording", folder + "/out"
        with open(folder + "/scenario.yaml", "w", encoding="utf-8") as file:
            yaml.safe_dump(scenario, file)
        subprocess.run([options.camgyro, "simulate", folder + "/scenario.yaml", *options.changes,
                        "--out", recording], check=True, stdout=subprocess.DEVNULL)
        if options.undeclared:
            with open(recording + "/imu0/sensor.yaml", encoding="utf-8") as file:
                lines = [line for line in file if "gyroscope_noise_density" not in line]
            with open(recording + "/imu0/sensor.yaml", "w", encoding="utf-8") as file:
                file.writelines(lines)
        if options.stream:
            command = [options.stream, recording, out]
        else:
            command = [options.camgyro, "diagnose" if options.diagnose else "calibrate", recording,
                       "--out", out, "--device", options.device]
            if options.effects:
                command.append("--effects=" + options.effects)
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if not os.path.exists(out + "/calibration.yaml"):
            print(seed, motion, "refused:", done.stderr.strip().split("\n")[-1], flush=True)
            return None
        with open(out + "/calibration.yaml", encoding="utf-8") as file:
            calibration = yaml.safe_load(file)
        with open(recording + "/truth.yaml", encoding="utf-8") as file:
            truth = yaml.safe_load(file)
        named = []
        if options.diagnose:
            with open(out + "/diagnosis.yaml", encoding="utf-8") as file:
                named = yaml.safe_load(file)["verdict"]["effects"]
        doubts = ["the pictures show something" in done.stdout,
                  "the two halves of the recording disagree" in done.stdout]
        if not options.clean:
            as_fitted(truth, calibration, recording, scenario["duration_s"], bool(options.stream))
        truth["clock"]["delay_s"]["value"] += latency_s(scenario)
        error, noise = errors(calibration, truth)
        total = np.array(calibration["covariance"]["total"])
        determined = np.array([name not in calibration["quality"]["unobservable"]
                               for name in calibration["covariance"]["order"]])
        return dict(error=error, noise=noise, total=total, doubts=doubts, determined=determined, named=named,
                    name="%s %d" % (motion, seed))


def as_fitted(truth, calibration, recording, duration_s, at_end):
    """What the effects shift by definition (docs/effects.md): a filter delays the gyro by its time
    constant, a drifting bias is that of the middle, under the mean force; where a gyro's clock was
    laid behind stamps of arrival and its rate is fitted, so is the delay. at_end: delay and bias are
    those of the last frame, as the library follows them."""
    values = {e["name"]: {p["name"]: p["value"] for p in e["parameters"]}
              for e in truth["effects"]}
    truth["clock"]["delay_s"]["value"] += values["gyro_lowpass"]["time_constant"]
    passed_s = 0.5 + duration_s * (1.0 if at_end else 0.5)
    if at_end or any(e["name"] == "clock_skew" and str(e["shape"]).isdigit()
                     for e in calibration["effects"]):
        truth["clock"]["delay_s"]["value"] += 1e-6 * values["clock_skew"]["skew"] * passed_s
    if at_end:  # as in simulation/effects/delay_wander.h
        wander = values["delay_wander"]
        turn = 2 * np.pi * duration_s / wander["period"]
        truth["clock"]["delay_s"]["value"] += wander["amplitude"] * float(
            0.7 * np.sin(turn) + 0.3 * np.sin(1.618 * turn + 1))
    force = np.loadtxt(recording + "/imu0/data.csv", delimiter=",")[:, 4:7].mean(axis=0)
    bias = truth["gyro"]["bias_rad_s"]
    bias["value"] = [
        b + values["bias_drift"]["rate_" + axis] * passed_s
        + values["gyro_g_sensitivity"][axis] * f
        for axis, b, f in zip("xyz", bias["value"], force)]


def beyond(name, errors_in_sigmas, limit, sigma):
    if np.any(np.abs(errors_in_sigmas) > limit):
        print("beyond %d %s in %s:" % (limit, sigma, name), ", ".join(
            "%s %.1f" % pair for pair in zip(NAMES, errors_in_sigmas) if abs(pair[1]) > limit))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="phone", choices=CLASSES)
    parser.add_argument("--seeds", default="1-200")
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--motions", default="walking,running,handheld")
    parser.add_argument("--clean", action="store_true")
    parser.add_argument("--strange", action="store_true")
    parser.add_argument("--rendered", action="store_true")
    parser.add_argument("--attitudes", action="store_true")
    parser.add_argument("--undeclared", action="store_true")
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--effects", metavar="LIST")
    parser.add_argument("--stream", metavar="PREPARE_VIO")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE")
    options = parser.parse_args()
    if options.stream and (options.diagnose or options.device != "phone"):
        parser.error("--stream: of phones, without --diagnose")
    if options.attitudes and (options.strange or options.rendered or options.stream):
        parser.error("--attitudes: not with --strange, --rendered or --stream")
    if options.effects and options.stream:
        parser.error("--effects: not with --stream")
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
    print("%d of %d devices of class %s%s%s calibrated; a doubt of the model in %d, of the halves in "
          "%d" % (len(results), len(seeds), options.device, ", clean" if options.clean else "",
                  (", strangely recorded" if options.strange else "")
                  + (", rendered" if options.rendered else "")
                  + (", attitudes" if options.attitudes else ""),
                  *np.sum([r["doubts"] for r in results], axis=0)))
    if options.diagnose:
        named = Counter(name for r in results for name in r["named"])
        print("named in %d: %s" % (sum(bool(r["named"]) for r in results),
                                   ", ".join("%s %d" % pair for pair in named.most_common())))
    print("| parameter | determined | within 3 sigma_total | rms error in sigma_total | "
          "sigma_total | spread of errors | sigma_total / spread of errors | "
          "rms error in sigma of noise |")
    print("| --- " * 8 + "|")
    for i, name in enumerate(NAMES):
        of = used[:, i]
        if not of.any():
            continue
        spread = 1.4826 * np.median(np.abs(error[of, i]))
        print("| %s | %d | %.1f %% | %.2f | %.2g | %.2g | %.2f | %.1f |" % (
            name, of.sum(), 100 * np.nanmean(np.abs(z[of, i]) < 3), np.sqrt(np.nanmean(z[of, i]**2)),
            np.median(sigma[of, i]), spread, np.median(sigma[of, i]) / spread,
            np.sqrt(np.mean((error[of, i] / noise[of, i])**2))))
    print("| all | %d | %.2f %% | %.2f | | | | %.2f |" % (
        used.sum(), 100 * np.mean(np.abs(z[used]) < 3), np.sqrt(np.mean(z[used]**2)),
        np.sqrt(np.mean((error[used] / noise[used])**2))))
    for r, errors_in_sigmas in zip(results, z):
        beyond(r["name"], errors_in_sigmas, 3, "sigma_total")
        if options.clean:  # has none of what the total allows for
            beyond(r["name"], np.where(r["determined"], r["error"] / r["noise"], 0.0), 4,
                   "sigma of noise")
    nees = []
    for r in results:
        has = np.isfinite(r["error"])  # attitudes have no lens
        nees.append(r["error"][has] @ np.linalg.solve(r["total"][np.ix_(has, has)], r["error"][has])
                    / has.sum())
    print("NEES per parameter with the total covariance: mean %.2f, median %.2f" % (
        np.mean(nees), np.median(nees)))


if __name__ == "__main__":
    main()
