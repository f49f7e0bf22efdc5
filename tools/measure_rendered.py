#!/usr/bin/python3
"""Renders video scenarios, calibrates them from their pictures, and writes docs/rendered.md.

    tools/measure_rendered.py [path of camgyro]        (default: build/release/tools/camgyro)

20 s of 640 x 480 each, tracked with the project's own KLT, beside the truth of the simulator.
"""
import math
import os
import subprocess
import sys
import tempfile

import yaml

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Scenario and what differs from its file.
RUNS = [("video_room", ["seed=1"]), ("video_room", ["seed=2"]),
        ("video_room", ["seed=3", "camera.readout_s=-0.016", "camera.delay_s=0.031"]),
        ("video_street", ["seed=1", "effects.radial_distortion={}"])]
# What is asked for; the last line of the table.
LIMITS = ("limit", "0.3", "0.5", "0.5", "0.15", "")


def angle_deg(p, q):
    """Angle between two quaternions (w, x, y, z)."""
    dot = abs(sum(a * b for a, b in zip(p, q)))
    norms = math.sqrt(sum(a * a for a in p) * sum(b * b for b in q))
    return math.degrees(2.0 * math.acos(min(1.0, dot / norms)))


def measure(camgyro, scenario, changes, folder):
    recording = os.path.join(folder, "recording")
    scenario_file = os.path.join(SOURCE, "tools/scenarios", scenario + ".yaml")
    subprocess.run([camgyro, "simulate", scenario_file, *changes, "--out", recording],
                   check=True, stdout=subprocess.DEVNULL)
    out = os.path.join(folder, "out")
    subprocess.run([camgyro, "calibrate", recording, "--out", out, "--quiet"], check=True,
                   stdout=subprocess.DEVNULL)
    load = lambda name: yaml.safe_load(open(name, encoding="utf-8"))
    found, truth = load(os.path.join(out, "calibration.yaml")), load(recording + "/truth.yaml")

    def gap(section, key, scale):
        value, sigma = found[section][key]["value"], found[section][key]["sigma"]
        return "%.3f ± %.3f" % (scale * (value - truth[section][key]["value"]), scale * sigma)

    f = truth["camera"]["focal_px"]["value"]
    q = angle_deg(found["extrinsics"]["q_gyro_cam_wxyz"]["value"],
                  truth["extrinsics"]["q_gyro_cam_wxyz"]["value"])
    sigma_q = math.degrees(math.hypot(*found["extrinsics"]["q_gyro_cam_wxyz"]["sigma_rad"]))
    return ("%s %s" % (scenario, " ".join(changes)), gap("clock", "delay_s", 1e3),
            gap("shutter", "readout_s", 1e3), gap("camera", "focal_px", 100.0 / f),
            "%.3f (sigma %.3f)" % (q, sigma_q), "%.3f" % found["quality"]["noise_px"])


def main():
    camgyro = sys.argv[1] if len(sys.argv) > 1 else SOURCE + "/build/release/tools/camgyro"
    rows = [("Recording", "t_d - truth [ms]", "t_r - truth [ms]", "f - truth [%]",
             "angle of q_c [deg]", "noise [px]"), ("---",) * 6]
    for scenario, changes in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(camgyro, scenario, changes, folder))
        print(*rows[-1], sep=" | ", flush=True)
    rows.append(LIMITS)
    with open(SOURCE + "/docs/rendered.md", "w", encoding="utf-8") as out:
        out.write("# Calibration from rendered video\n\nMade by `tools/measure_rendered.py`: "
                  "scenarios of `tools/scenarios`, 20 s of 640 x 480 at 30 frames/s, rendered row "
                  "by row with motion blur, photon noise and vignetting, encoded as H.264, tracked "
                  "with the project's own KLT, calibrated without any guess.\n\n")
        out.writelines("| " + " | ".join(row) + " |\n" for row in rows)


if __name__ == "__main__":
    main()
