#!/usr/bin/python3
"""Runs `camgyro calibrate` on every measured recording and writes docs/lab/measured.md.

    tools/measure.py [path of camgyro]        (default: build/release/tools/camgyro)

The recordings lie in $CAMGYRO_DATA (default: ../shared/data beside the source). What is known of
them independently is written down below; the estimator never sees it. docs/lab/measured_notes.md is
put in front of the tables word by word. Standard library only.
"""
import csv
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
import time

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DATA = os.path.abspath(os.environ.get("CAMGYRO_DATA", os.path.join(SOURCE, "../shared/data")))

# Camera vectors into the gyro frame. Android: gyro x, y, z = camera -y, -x, -z.
ANDROID = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
# EuRoC cam0 T_BS, rotation (original/cam0_sensor.yaml of euroc-v101-flight).
EUROC = [[0.0148655429818, -0.999880929698, 0.00414029679422],
         [0.999557249008, 0.0149672133247, 0.025715529948],
         [-0.0257744366974, 0.00375618835797, 0.999660727178]]


def matrix(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def angle_deg(a, b):
    trace = sum(a[i][j] * b[i][j] for i in range(3) for j in range(3))
    return math.degrees(math.acos(max(-1.0, min(1.0, 0.5 * (trace - 1.0)))))


# EuRoC's published lens (ov_*/truth.yaml, original/cam0_sensor.yaml): of it, the distortion and the
# ratio fu / fv are declared; focal length and centre stay rough guesses.
LENS = ("intrinsics: [%.3f, 470.0, 376.0, 240.0]\ndistortion_model: radtan\n"
        "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 0.00001762]\n"
        % (470.0 * 458.654 / 457.296))

# Known independently, with its source. f: rows [px]; c [px]; t_r, t_d [ms]; R: camera -> gyro.
OV = dict(f=457.296, c=(367.215, 248.375), td=30.0,  # truth.yaml of each
          R=matrix(0.712301461, -0.00770718, 0.010499323, 0.7017528))
RECORDINGS = [
    # README: K_cc9_600_800 of the source; stamp is the start of frame, exposure 5.1..5.7 ms.
    ("phone-cc9-street", "", dict(f=575.0448, c=(406.0101, 309.0112), td=-2.6, R=ANDROID)),
    # README: checkerboard calibration; the source maps the gyro as (x, -y, -z).
    ("iphone-cards", "", dict(f=567.30, c=(243.35, 342.38), R=[[1, 0, 0], [0, -1, 0], [0, 0, -1]])),
    ("gopro-hero5-karma/karma.mp4", "", {}),
    ("gopro-hero7-hypersmooth/hero7.mp4", "", dict(tr=8.015)),  # SROT in the file
    # README: published calibration.py; middle of the exposure.
    ("tablet-shield-burst", "", dict(f=1558.6899, c=(939.6533, 518.4131), tr=24.4944, td=-7.55,
                                     R=ANDROID)),
    # original/cam0_sensor.yaml; global shutter, hardware-synchronised.
    ("euroc-v101-flight", "", dict(f=457.296, c=(367.215, 248.375), tr=0.0, td=0.0, R=EUROC)),
    ("euroc-v101-flight", "lens given", dict(f=457.296, c=(367.215, 248.375), tr=0.0, td=0.0,
                                             R=EUROC)),
    ("euroc-v101-rest", "", dict(f=457.296, c=(367.215, 248.375), tr=0.0, td=0.0, R=EUROC)),
    # README: the axis map is Android's.
    ("phone-edge-hand", "", dict(R=ANDROID)),
    ("ov_handheld_gs", "lens given", dict(OV, tr=0.0)),
    ("ov_handheld_rs", "lens given", dict(OV, tr=25.0)),
    ("ov_handheld_rs_skew", "lens given", dict(OV, tr=25.0)),
    ("ov_handheld_gs", "", dict(OV, tr=0.0)),
    ("ov_handheld_rs", "", dict(OV, tr=25.0)),
    ("ov_handheld_rs_skew", "", dict(OV, tr=25.0)),
] + [
    # README: A + B, a throw-away fit of ours (not independent); the axis map is Android's.
    ("tablet-attitude/" + name, "", dict(td=td, td_is_ours=True, R=ANDROID))
    for name, td in [("D01", 63.6), ("D02", 993.0), ("D03", 10477.4), ("D04", 41139.2),
                     ("D05", 31.7), ("D06", 464951.4), ("D07", 38216.6), ("D08", 2500.9),
                     ("D10", 98.8), ("D11", 24.6), ("D12", 18981.1), ("D13", 18617.8)]
] + [("tango-walk/imu%d" % i, "", {}) for i in range(1, 6)] + [
    # README: ARKit fuses this very gyro.
    ("arkit-attitude/demo1", "", dict(td=0.0))]


def with_lens(recording, folder):
    """A copy of the recording (links) whose sensor.yaml declares the lens distortion."""
    copy = os.path.join(folder, os.path.basename(recording))
    os.makedirs(os.path.join(copy, "cam0"))
    os.symlink(os.path.join(recording, "imu0"), os.path.join(copy, "imu0"))
    for name in os.listdir(os.path.join(recording, "cam0")):
        source = os.path.join(recording, "cam0", name)
        if name != "sensor.yaml":
            os.symlink(source, os.path.join(copy, "cam0", name))
            continue
        with open(source) as file, open(os.path.join(copy, "cam0", name), "w") as out:
            for line in file:
                out.write(LENS if line.startswith("intrinsics:") else line)
    return copy


def pair(text, key):
    """value and sigma of `key: {value: .., sigma..: .., ..}` in calibration.yaml, as lists."""
    match = re.search(r"%s: \{value: (\[[^]]*\]|[^,]*), sigma\w*: (\[[^]]*\]|[^,}]*)" % key, text)
    return [[float(x.replace(".nan", "nan")) for x in group.strip("[]").split(",")]
            for group in match.groups()]


def scalar(text, key):
    match = re.search(r"^  %s: (\S+)" % key, text, re.MULTILINE)
    return float(match.group(1).replace(".nan", "nan")) if match else None


def read_result(folder):
    with open(os.path.join(folder, "calibration.yaml")) as file:
        text = file.read()
    result = dict(f=pair(text, "focal_px"), c=pair(text, "principal_px"),
                  tr=pair(text, "readout_s"), td=pair(text, "delay_s"),
                  q=pair(text, "q_gyro_cam_wxyz"))
    for key in ("tr", "td"):
        result[key] = [[1e3 * x for x in values] for values in result[key]]
    for key in ("noise_px", "rms_px", "unseen_rms_px", "noise_rad", "inlier_ratio"):
        result[key] = scalar(text, key)
    result["mended"] = "repaired: true" in text or "mended: true" in text
    result["unobservable"] = re.search(r"unobservable: \[(.*)\]", text).group(1).split(", ")
    with open(os.path.join(folder, "trace.csv")) as file:
        rows = list(csv.DictReader(line.lstrip("#") for line in file))
    if rows:
        last = {key: float(value) for key, value in rows[-1].items()}
        result["online"] = dict(
            f=last["focal_px"], tr=1e3 * last["readout_s"], td=1e3 * last["delay_s"],
            q=[last[key] for key in ("q_w", "q_x", "q_y", "q_z")],
            sigma=dict(f=last["sigma_focal_px"], tr=1e3 * last["sigma_readout_s"],
                       td=1e3 * last["sigma_delay_s"]))
    return result


def run(camgyro, recording, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([camgyro, "calibrate", recording, "--out=" + folder],
                          capture_output=True, text=True, check=False)
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    outcome = dict(exit_code=done.returncode, cpu_s=cpu, out=done.stdout,
                   message=done.stderr.strip().split("\n")[-1])
    if os.path.exists(os.path.join(folder, "calibration.yaml")):
        outcome.update(read_result(folder))
        rate = re.search(r"window [0-9.]+ s \(([0-9.]+) frames/s\)", done.stdout)
        outcome["frames_s"] = rate.group(1) if rate else ""
        words = re.sub(r"\n {11}", " ", done.stdout)
        outcome["doubts"] = re.findall(r"^doubt +(.*)$", words, re.MULTILINE)
    return outcome


def cell(result, key, name, known, digits):
    """value +- sigma | known; in brackets where the motion did not determine it."""
    value, sigma = result[key][0], result[key][1]
    if math.isnan(value[0]):
        return "-"
    text = ", ".join("%.*f" % (digits, x) for x in value)
    text += " ± " + "%.*f" % (digits, max(sigma))
    if name in result["unobservable"]:
        text = "(" + text + ")"
    if known is not None:
        known = known if isinstance(known, tuple) else (known,)
        text += " / " + ", ".join("%.*f" % (digits, x) for x in known)
    return text


def first_try(r):
    """What somebody gets who gives the recording to the program as it is."""
    if "f" not in r:
        return "no"
    if r["exit_code"] != 0:
        return "nothing determined"
    return "after repair" if r["mended"] else "yes"


def value_row(name, truth, r):
    if "f" not in r:
        message = r["message"].replace("camgyro: ", "").replace("|", "/")
        return "| %s | %s | %d | %s |" % (name, first_try(r), r["exit_code"], message) + " |" * 5
    turn = angle_deg(matrix(*r["q"][0]), truth["R"]) if "R" in truth else None
    turn_sigma = math.degrees(math.sqrt(sum(x * x for x in r["q"][1])))
    q = "-" if turn is None else "%.2f ± %.2f" % (turn, turn_sigma)
    if {"q_x", "q_y", "q_z"} & set(r["unobservable"]):
        q = "(" + q + ")"
    td = cell(r, "td", "delay_s", truth.get("td"), 2) + ("*" if truth.get("td_is_ours") else "")
    doubts = "; ".join(r["doubts"]) or "calibrated"
    return "| " + " | ".join([name, first_try(r), str(r["exit_code"]), doubts, cell(r, "f", "focal_px", truth.get("f"), 1),
                              cell(r, "c", "cx_px", truth.get("c"), 1),
                              cell(r, "tr", "readout_s", truth.get("tr"), 2), td, q]) + " |"


def quality_row(name, r):
    if r["noise_px"] is not None:
        noise, rms = "%.3f px" % r["noise_px"], "%.3f px" % r["rms_px"]
    else:
        noise, rms = "%.2f mrad" % (1e3 * r["noise_rad"]), "-"
    unseen = "-" if r["unseen_rms_px"] is None else "%.3f px" % r["unseen_rms_px"]
    return "| %s | %s | %.0f %% | %s | %s | %s | %.0f |" % (
        name, noise, 100 * r["inlier_ratio"], rms, unseen, r["frames_s"] or "-", r["cpu_s"])


def online_row(name, truth, r):
    online, cells = r["online"], []
    for key, state, digits in (("f", "focal_px", 2), ("tr", "readout_s", 3), ("td", "delay_s", 3)):
        text = "%.*f ± %.*f" % (digits, online[key], digits, online["sigma"][key])
        if state in r["unobservable"]:
            text = "(" + text + ")"
        elif key in truth:
            errors = abs(online[key] - truth[key]), abs(r[key][0][0] - truth[key])
            text += ", off by %.*f; refined %.*f; ratio %.1f" % (
                digits, errors[0], digits, errors[1], errors[0] / max(errors[1], 1e-9))
        cells.append(text)
    if "R" in truth:
        errors = [angle_deg(matrix(*q), truth["R"]) for q in (online["q"], r["q"][0])]
        cells.append("%.3f; refined %.3f; ratio %.1f" % (*errors, errors[0] / max(errors[1], 1e-9)))
    else:
        cells.append("-")
    return "| " + " | ".join([name] + cells) + " |"


def main():
    camgyro = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else
                              os.path.join(SOURCE, "build/release/tools/camgyro"))
    values, quality, online = [], [], []
    begin = time.time()
    with tempfile.TemporaryDirectory() as temporary:
        for index, (name, variant, truth) in enumerate(RECORDINGS):
            recording = os.path.join(DATA, name)
            if not os.path.exists(recording):
                sys.exit("%s: not found (set CAMGYRO_DATA)" % recording)
            work = os.path.join(temporary, str(index))
            if variant:
                recording = with_lens(recording, work)
            label = name + (", " + variant if variant else "")
            r = run(camgyro, recording, os.path.join(work, "result"))
            print("%s: exit code %d, %.0f s CPU\n%s%s" % (
                label, r["exit_code"], r["cpu_s"], r["out"], r["message"]), flush=True)
            values.append(value_row(label, truth, r))
            if "f" in r:
                quality.append(quality_row(label, r))
            if "online" in r:
                online.append(online_row(label, truth, r))
    notes = os.path.join(SOURCE, "docs/lab/measured_notes.md")
    preamble = open(notes).read().rstrip() + "\n\n" if os.path.exists(notes) else ""
    with open(os.path.join(SOURCE, "docs/lab/measured.md"), "w") as out:
        out.write("# Measured recordings\n\nMade by `tools/measure.py`; the text before the tables "
                  "is `docs/lab/measured_notes.md`.\n\n" + preamble)
        out.write("## Values\n\nvalue ± sigma / what is known independently. In brackets: not "
                  "determined by this motion, says the program. q_c: angle to the known mounting, "
                  "and the norm of its three sigmas. *: a fit of ours, not independent. Exit code "
                  "4: could not estimate. First try: what somebody gets who knows nothing of "
                  "the recording; after repair: the program mended stamps or samples by itself.\n\n"
                  "| Recording | First try | Exit | Verdict | f [px] | c [px] | t_r [ms] | t_d [ms] | "
                  "q_c [deg] |\n|" + " --- |" * 9 + "\n" + "\n".join(values) + "\n\n")
        out.write("## Quality and time\n\nFrames/s: of the online pass, wall clock; CPU: of the "
                  "whole command, tracking included.\n\n"
                  "| Recording | Noise | Inliers | rms | Unseen rms | Frames/s | CPU [s] |\n|"
                  + " --- |" * 7 + "\n" + "\n".join(quality) + "\n\n")
        out.write("## Online estimate beside the refined one\n\nThe last window of the online pass "
                  "± its sigma; errors against what is known, and their ratio.\n\n"
                  "| Recording | f [px] | t_r [ms] | t_d [ms] | q_c [deg] |\n|" + " --- |" * 5
                  + "\n" + "\n".join(online) + "\n")
    print("docs/lab/measured.md written after %.0f s" % (time.time() - begin))


if __name__ == "__main__":
    main()
