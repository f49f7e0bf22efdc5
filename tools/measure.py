#!/usr/bin/python3
"""Runs `camgyro calibrate` on every measured recording and writes docs/lab/measured.md.

    tools/measure.py [--camgyro PATH] [--keep FOLDER] [--only WORD]

The recordings lie in $CAMGYRO_DATA (default: ../shared/data beside the source). What is known of
them independently is written down below, or in the truth.yaml of the simulated ones; the estimator
never sees it. docs/lab/measured_notes.md is put in front of the tables word by word. With --keep,
results stay in FOLDER, and those that are there are not made again; with --only, the tables of the
recordings whose name contains WORD are printed, and no file is written.
"""
import argparse
import csv
import os
import re
import resource
import subprocess
import tempfile

import numpy as np
import yaml

from calibration_errors import NAMES, multiply
from recording_copy import copy_recording

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DATA = os.path.abspath(os.environ.get("CAMGYRO_DATA", os.path.join(SOURCE, "../shared/data")))
LABELS = dict(zip(NAMES, ("f [px]", "c_x [px]", "c_y [px]", "t_r [ms]", "t_d [ms]", "b_x", "b_y",
                          "b_z", "q_x", "q_y", "q_z")))
SCALE = np.array([1, 1, 1, 1e3, 1e3, 1, 1, 1, 1, 1, 1])  # s to ms
DIGITS = (1, 1, 1, 2, 2)

# The camera's vectors into the gyro's frame, as quaternions w, x, y, z. The axis map of Android
# (gyro x, y, z = camera -y, -x, -z) says which axis is which; a device is off it by degrees.
ANDROID = (0.0, np.sqrt(0.5), -np.sqrt(0.5), 0.0)
# EuRoC cam0 T_BS, of original/cam0_sensor.yaml; the ov_* use the same.
EUROC_Q = (0.712301461, -0.00770718, 0.010499323, 0.7017528)

# EuRoC's published lens: of it, distortion and ratio fu / fv are declared; focal length and centre
# stay rough guesses.
LENS = ("intrinsics: [%.3f, 470.0, 376.0, 240.0]\ndistortion_model: radtan\n"
        "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 0.00001762]\n"
        % (470.0 * 458.654 / 457.296))

# Two calibrations of one camera: original/cam0_sensor.yaml, and data/euroc_ds_calib.json of Basalt
# (gitlab.com/VladyslavUsenko/basalt), whose focal length in the middle is fy / (1 + xi). Both have
# the same ratio fx / fy. Biases: of the ground-truth file (README.md of euroc-v101-rest), and the
# gyro's mean over the first 4 s of the recording, at rest. Global shutter; hardware-synchronised.
EUROC = dict(f=(457.296, 459.429), ratio=458.654 / 457.296, c_x=(367.215, 365.894),
             c_y=(248.375, 249.330), t_r=0.0, t_d=0.0,
             b_x=(-0.0022, -0.0020), b_y=(0.0207, 0.0209), b_z=(0.0758, 0.0781), q=EUROC_Q,
             other_q=(0.712312551, -0.007239826, 0.007541279, 0.701784543))
FOUND_LENS = "--effects=radial_distortion,aspect_ratio"
USUAL = "--effects=usual"


def rows_of(name, known, *variants):
    """A row for the recording as it is, and one for each variant of flags; LENS is declared for
    the flag `lens`. Known values in px, s and rad/s, two if sources differ; `q` (and `other_q`) is
    a mounting, `axes` a map of axes only, as quaternions."""
    return [(name, flags, known) for flags in ("",) + variants]


RECORDINGS = (
    # README: K_cc9_600_800 of the source; a stamp is the start of a frame, exposures 5.1..5.7 ms.
    rows_of("phone-cc9-street", dict(f=575.0448, c_x=406.0101, c_y=309.0112, t_d=-2.6e-3,
                                     axes=ANDROID), USUAL)
    # README: checkerboard calibration; the source maps the gyro as (x, -y, -z).
    + rows_of("iphone-cards", dict(f=567.30, c_x=243.35, c_y=342.38, axes=(0, 1, 0, 0)))
    + rows_of("gopro-hero5-karma/karma.mp4", {})
    + rows_of("gopro-hero7-hypersmooth/hero7.mp4", {})
    + rows_of("tablet-shield-burst", {})
    + rows_of("euroc-v101-flight", EUROC, "lens --device=industrial",
              "--effects=radial_distortion:kannala_brandt,aspect_ratio --device=industrial",
              USUAL + " --device=industrial")
    + rows_of("euroc-v101-rest", EUROC)
    # README: the axis map is Android's.
    + rows_of("phone-edge-hand", dict(axes=ANDROID), "--effects=radial_distortion", USUAL)
    + rows_of("ov_handheld_gs", None, "lens --device=industrial", FOUND_LENS, USUAL)
    + rows_of("ov_handheld_rs", None, "lens --device=industrial", FOUND_LENS, USUAL)
    + rows_of("ov_handheld_rs_skew", None, "lens --device=industrial",
              FOUND_LENS + ",clock_skew", USUAL)
    + [(name, flags, None) for name in ("ov_corridor_rs", "ov_corridor_rs_klt", "ov_mav_gs")
       for flags in (FOUND_LENS, USUAL)]
    + [("tablet-attitude/D%02d" % i, "", dict(axes=ANDROID))
       for i in (1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13)]
    + [("tango-walk/imu%d" % i, "", {}) for i in range(1, 6)]
    # README: ARKit fuses this very gyro.
    + rows_of("arkit-attitude/demo1", dict(t_d=0.0)))


def known_of(name, known):
    """What is written down above, or in truth.yaml of a simulated recording."""
    if known is not None:
        return known
    with open(os.path.join(DATA, name, "truth.yaml"), encoding="utf-8") as file:
        truth = yaml.safe_load(file)
    values = (truth["camera"]["focal_px"]["value"], *truth["camera"]["principal_px"]["value"],
              truth["shutter"]["readout_s"]["value"], truth["clock"]["delay_s"]["value"],
              *truth["gyro"]["bias_rad_s"]["value"])
    known = dict(zip(NAMES, values), q=truth["extrinsics"]["q_gyro_cam_wxyz"]["value"],
                 ratio=truth["camera"]["aspect_ratio"]["value"])
    if name.startswith("ov_handheld"):  # the bias at the start, from where it walks
        known = {key: value for key, value in known.items() if not key.startswith("b_")}
    return known


def with_ratio_of(known, r):
    """f is the focal length of the rows, fy; that of the columns is ratio * fy. A fit that holds the
    ratio at 1 finds something between the two: what is known is brought to the fit's ratio, so that
    the mean of fx and fy is compared."""
    if "ratio" not in known or "ratio" not in r:
        return known
    return {**known, "f": np.atleast_1d(known["f"]) * (1 + known["ratio"]) / (1 + r["ratio"])}


def with_lens(recording, folder):
    """A copy of the recording (links) whose sensor.yaml declares the lens distortion."""
    return copy_recording(recording, os.path.join(folder, os.path.basename(recording)),
                          sensor=lambda text: re.sub(r"(?m)^intrinsics:.*\n", LENS, text))


def rotation(known, q):
    """The small rotation from the known mounting to q, about the camera's axes [rad]."""
    difference = multiply(np.array(known) * [1, -1, -1, -1], q)
    difference *= np.sign(difference[0]) or 1.0
    sine = np.linalg.norm(difference[1:])
    return 2 * np.arctan2(sine, difference[0]) * difference[1:] / max(sine, 1e-12)


def run(camgyro, recording, flags, folder):
    """Calibrates into `folder`, if it has no outcome yet; what came of it."""
    outcome = os.path.join(folder, "outcome.yaml")
    if not os.path.exists(outcome):
        os.makedirs(folder, exist_ok=True)
        given = [flag for flag in flags.split() if flag != "lens"]
        source = with_lens(recording, folder) if "lens" in flags.split() else recording
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run([camgyro, "calibrate", source, "--out=" + folder, *given],
                              capture_output=True, text=True, check=False)
        cpu_s = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        with open(outcome, "w", encoding="utf-8") as file:
            yaml.safe_dump(dict(exit_code=done.returncode, cpu_s=cpu_s, out=done.stdout,
                                message=done.stderr.strip().split("\n")[-1]), file)
    with open(outcome, encoding="utf-8") as file:
        r = yaml.safe_load(file)
    if os.path.exists(os.path.join(folder, "calibration.yaml")):
        r.update(read_result(folder))
        words = re.sub(r"\n {11}", " ", r["out"])
        r["doubts"] = re.findall(r"^doubt +(.*)$", words, re.MULTILINE)
        rate = re.search(r"window [0-9.]+ s \(([0-9.]+) frames/s\)", r["out"])
        r["frames_s"] = rate.group(1) if rate else "-"
    return r


def read_result(folder):
    """values, sigma and total in the order of NAMES (the rotation's value: q), and the rest."""
    with open(os.path.join(folder, "calibration.yaml"), encoding="utf-8") as file:
        c = yaml.safe_load(file)
    q = c["extrinsics"]["q_gyro_cam_wxyz"]
    values = [c["camera"]["focal_px"]["value"], *c["camera"]["principal_px"]["value"],
              c["shutter"]["readout_s"]["value"], c["clock"]["delay_s"]["value"],
              *c["gyro"]["bias_rad_s"]["value"], 0.0, 0.0, 0.0]
    def sigmas(key):
        return np.sqrt(np.diag(np.array(c["covariance"][key], dtype=float)))[:len(NAMES)]
    order = c["covariance"]["order"][:len(NAMES)]
    result = dict(values=np.array(values, dtype=float), q=q["value"], sigma=sigmas("matrix"),
                  ratio=c["camera"]["aspect_ratio"]["value"],
                  total=sigmas("total") if "total" in c["covariance"] else None,
                  determined=np.array([n not in c["quality"]["unobservable"] for n in order]),
                  shares={e["name"]: np.array(e["sigma"], dtype=float)[:len(NAMES)]
                          for e in c.get("systematic", {}).get("effects", [])},
                  quality=c["quality"],
                  mended=any(s.get("repaired") for s in c.get("stamps", {}).values())
                  or any(f.get("mended") for f in c.get("faults", [])))
    with open(os.path.join(folder, "trace.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(line.lstrip("#") for line in file))
    if rows:
        last = {key: float(value) for key, value in rows[-1].items()}
        columns = order[:5]
        result["online"] = dict(values=np.array([last[n] for n in columns]),
                                sigma=np.array([last["sigma_" + n] for n in columns]),
                                q=[last[n] for n in ("q_w", "q_x", "q_y", "q_z")])
    return result


def first_try(r, flags):
    """What somebody gets who gives the recording to the program as it is."""
    if flags:
        return "-"
    if "values" not in r:
        return "no"
    if r["exit_code"] != 0:
        return "nothing determined"
    return "after repair" if r["mended"] else "yes"


def brackets(text, determined):
    return text if determined else "(" + text + ")"


def value_row(label, known, r):
    cells = [label]
    for i in range(5):
        if np.isnan(r["values"][i]):
            cells.append("-")
            continue
        numbers = [r["values"][i], r["sigma"][i]] + ([] if r["total"] is None else [r["total"][i]])
        text = " ± ".join("%.*f" % (DIGITS[i], SCALE[i] * x) for x in numbers)
        text = brackets(text, r["determined"][i])
        if NAMES[i] in known:
            text += " / " + " and ".join("%.*f" % (DIGITS[i], SCALE[i] * x)
                                         for x in np.atleast_1d(known[NAMES[i]]))
        cells.append(text)
    mounting = known.get("q", known.get("axes"))
    if mounting is None:
        cells.append("-")
    else:
        numbers = [rotation(mounting, r["q"]), r["sigma"][8:]] + (
            [] if r["total"] is None else [r["total"][8:]])
        text = " ± ".join("%.2f" % np.degrees(np.linalg.norm(x)) for x in numbers)
        cells.append(brackets(text, r["determined"][8:].all()))
    return cells


def errors_in_total(known, r):
    """Error of each parameter that is known, in sigma_total; NaN where it is not. Where two sources
    differ: from their mean, with half of their difference as another sigma."""
    both = [np.atleast_1d(known.get(name, np.nan)) for name in NAMES]
    errors = r["values"] - [np.mean(x) for x in both]
    half = np.array([0.5 * np.ptp(x) for x in both])
    if "q" in known:
        apart = 0.5 * rotation(known["q"], known.get("other_q", known["q"]))
        errors[8:], half[8:] = rotation(known["q"], r["q"]) - apart, np.abs(apart)
    return errors / np.hypot(r["total"], half)


def error_row(label, z, r):
    cells = [label]
    for i, error in enumerate(z):
        if np.isnan(error):
            cells.append("")
            continue
        effect, share = max(((name, s[i]) for name, s in r["shares"].items()),
                            key=lambda named: named[1], default=("", 0.0))
        by = effect if share > r["sigma"][i] else "noise"
        cells.append(brackets("%+.1f %s" % (error, by), r["determined"][i]))
    return cells


def quality_row(label, r):
    quality = r["quality"]
    if "noise_px" in quality:
        noise, rms = "%.3f px" % quality["noise_px"], "%.3f px" % quality["rms_px"]
        scatter = "± %.0f %%" % (100 * quality["noise_scatter"])
    else:
        noise, rms, scatter = "%.3f mrad" % (1e3 * quality["noise_rad"]), "-", "-"
    unseen = "%.3f px" % quality["unseen_rms_px"] if "unseen_rms_px" in quality else "-"
    return [label, noise, scatter, "%.0f %%" % (100 * quality["inlier_ratio"]), rms, unseen,
            r["frames_s"], "%.0f" % r["cpu_s"]]


def online_row(label, known, r):
    online, cells = r["online"], [label]
    for i in (0, 3, 4):
        text = "%.*f ± %.*f" % (DIGITS[i] + 1, SCALE[i] * online["values"][i], DIGITS[i] + 1,
                                SCALE[i] * online["sigma"][i])
        text = brackets(text, r["determined"][i])
        if NAMES[i] in known and r["determined"][i]:
            errors = [abs(x - np.mean(known[NAMES[i]])) * SCALE[i]
                      for x in (online["values"][i], r["values"][i])]
            text += ", off by %.*f; refined %.*f" % (DIGITS[i] + 1, errors[0], DIGITS[i] + 1,
                                                     errors[1])
        cells.append(text)
    mounting = known.get("q", known.get("axes"))
    cells.append("-" if mounting is None else "%.2f; refined %.2f" % tuple(
        np.degrees(np.linalg.norm(rotation(mounting, q))) for q in (online["q"], r["q"])))
    return cells


def table(head, rows):
    lines = [head, ["---"] * len(head)] + rows
    return "".join("| " + " | ".join(line) + " |\n" for line in lines) + "\n"


def tables(results):
    """The tables of [(label, flags, known, result)], as text."""
    tries, values, errors, quality, online, all_z = [], [], [], [], [], []
    for label, flags, known, r in results:
        says = r["message"] if "values" not in r else "; ".join(r["doubts"]) or "no doubt"
        tries.append([label, first_try(r, flags), str(r["exit_code"]),
                      says.replace("camgyro: ", "").replace("|", "/")])
        if "values" not in r:
            continue
        values.append(value_row(label, known, r))
        quality.append(quality_row(label, r))
        if r["total"] is not None:
            z = errors_in_total(known, r)
            if not np.isnan(z).all():
                errors.append(error_row(label, z, r))
                all_z += list(z[r["determined"] & ~np.isnan(z)])
        if "online" in r:
            online.append(online_row(label, known, r))
    size = np.abs(all_z)
    return (
        "## First try\n\nWhat somebody gets who gives the recording to the program as it is; after "
        "repair: it mended stamps or samples by itself. Rows with flags are no first tries; `lens`: "
        "the published distortion and ratio fu / fv are in sensor.yaml. Exit code 4: no estimate, "
        "or nothing determined.\n\n"
        + table(["Recording", "First try", "Exit", "What the program says"], tries)
        + "## Values\n\nvalue ± sigma ± sigma_total / what is known independently. In brackets: not "
        "determined by this motion, says the program. q_c: angle to the known mounting, or to the "
        "axis map, and the norms of its three sigmas [deg]. f is that of the rows; what is known is "
        "brought to the ratio fx / fy of the fit, where that is another one, so that the mean of both "
        "is compared.\n\n"
        + table(["Recording"] + [LABELS[n] for n in NAMES[:5]] + ["q_c [deg]"], values)
        + "## Errors in sigma_total\n\nOf every parameter that is known independently: error in "
        "sigma_total, and the effect whose knowledge would save most of the total (noise, if it is "
        "larger). In brackets: not determined, says the program; these are not counted. An axis "
        "map is no known mounting. Where two calibrations differ, the error is that from their "
        "mean, and half of their difference is added to sigma_total in squares.\n\n"
        + table(["Recording"] + list(NAMES), errors)
        + "Of %d parameters, %d are within 3 sigma_total; rms %.2f.\n\n" % (
            len(size), (size < 3).sum(), np.sqrt(np.mean(size**2)) if len(size) else np.nan)
        + "## Quality and time\n\nFrames/s: of the online pass, wall clock; CPU: of the whole "
        "command, tracking included.\n\n"
        + table(["Recording", "Noise", "from pair to pair", "Inliers", "rms", "Unseen rms",
                 "Frames/s", "CPU [s]"], quality)
        + "## Online estimate beside the refined one\n\nThe last window of the online pass ± its "
        "sigma; errors against what is known.\n\n"
        + table(["Recording", "f [px]", "t_r [ms]", "t_d [ms]", "q_c [deg]"], online)).rstrip("\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--keep", help="folder of results")
    parser.add_argument("--only", default="", metavar="WORD")
    options = parser.parse_args()
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        for name, flags, known in RECORDINGS:
            if options.only not in name:
                continue
            recording = os.path.join(DATA, name)
            if not os.path.exists(recording):
                raise SystemExit("%s: not found (set CAMGYRO_DATA)" % recording)
            label = name + (", `%s`" % flags if flags else "")
            folder = os.path.join(options.keep or temporary, re.sub(r"\W+", "_", label))
            r = run(os.path.abspath(options.camgyro), recording, flags, folder)
            print("%s: exit code %d, %.0f s CPU" % (label, r["exit_code"], r["cpu_s"]), flush=True)
            results.append((label, flags, with_ratio_of(known_of(name, known), r), r))
    if options.only:
        print(tables(results))
        return
    with open(os.path.join(SOURCE, "docs/lab/measured_notes.md"), encoding="utf-8") as file:
        notes = file.read().rstrip()
    with open(os.path.join(SOURCE, "docs/lab/measured.md"), "w", encoding="utf-8") as out:
        out.write("# Measured recordings\n\nMade by `tools/measure.py`; the text before the tables "
                  "is `docs/lab/measured_notes.md`.\n\n" + notes + "\n\n" + tables(results) + "\n")


if __name__ == "__main__":
    main()
