#!/usr/bin/python3
"""Runs `camgyro odometry` where the way is known, and prints the tables of docs/lab/odometry.md.

    tools/measure_odometry.py [--walks] [path of camgyro]

Recordings of $CAMGYRO_DATA (default ../shared/data) with the calibration that camgyro finds of them
(`--effects=radial_distortion,aspect_ratio`), which knows nothing of the truth; then the same with
the clock as others have it, held:

  calibrated  delay, readout and their covariance from the calibration
  rectified   the recording of `camgyro rectify`, delay and readout zero
  searched    the delay of the middle row from `camgyro delay`, as in Feng, Li & Dai, and no readout
  ignored     neither delay nor readout

--walks: tools/scenarios/walk_230m.yaml and walk_400m.yaml as ready tracks, calibrated (no effects:
the lens has none) and ignored; then the first as a rendered video of 320 x 240 pixels, with loops.
"""
import argparse
import os
import pathlib
import re
import subprocess
import tempfile

import yaml

from trajectory_errors import Poses, Truth, figures

SOURCE = pathlib.Path(__file__).resolve().parents[1]
DATA = pathlib.Path(os.environ.get("CAMGYRO_DATA", SOURCE.parent / "shared/data"))
EFFECTS = "--effects=radial_distortion,aspect_ratio"
GRAVITY = "--gravity=9.81"  # of the simulator that made these recordings
RECORDINGS = ("ov_corridor_rs", "ov_corridor_rs_klt", "ov_mav_gs")


def run(*command):
    return subprocess.run([str(c) for c in command], check=False, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)


def held(calibration, delay_s, readout_s, to):
    """The calibration with another clock, as if all of it were exactly known."""
    c = yaml.safe_load(calibration.read_text(encoding="utf-8"))
    c["clock"]["delay_s"], c["shutter"]["readout_s"] = float(delay_s), float(readout_s)
    camera = c["camera"]
    for key in ("focal_px", "principal_px"):
        camera[key] = camera[key]["value"]
    c["gyro"]["bias_rad_s"] = c["gyro"]["bias_rad_s"]["value"]
    for key in ("covariance", "total_covariance", "effects"):
        c.pop(key, None)
    to.write_text(yaml.safe_dump(c), encoding="utf-8")


def row(camgyro, truth, recording, variant, calibration, folder):
    out = folder / f"{recording.name}_{variant}"
    answer = run(camgyro, "odometry", recording, f"--calibration={calibration}", GRAVITY,
                 f"--out={out}")
    name = f"| {truth_name(recording)} | {variant} | "
    if not (out / "keyframes.csv").exists():
        print(name + answer.stdout.strip().splitlines()[-1] + " |" + " |" * 8, flush=True)
        return
    verdict = yaml.safe_load((out / "odometry.yaml").read_text(encoding="utf-8"))["verdict"]
    seconds = [line.split() for line in answer.stdout.splitlines() if line.startswith("time")][0]
    keyframes, poses = Poses(out / "keyframes.csv"), Poses(out / "trajectory.csv")
    online, window = (figures(truth, p, keyframes) for p in (poses, keyframes))
    print(name + f"{verdict} | {online['path_m']:.1f} | {online['rmse_4_m']:.4f} | "
          f"{window['rmse_4_m']:.4f} | {online['scale_%']:+.2f} | {online['rel_5m_%']:.2f} | "
          f"{online['end_%']:.3f} | {online['nees']:.2f} | "
          f"{len(poses.p) / float(seconds[1]):.0f} |", flush=True)


def truth_name(recording):
    return recording.name.replace("rectified_", "")


WALKS = {"walk_230m": ("walk_230m", []),
         "walk_400m": ("walk_400m", []),
         "video_230m": ("walk_230m", ["video.format=mp4", "camera.resolution=[320, 240]",
                                      "camera.focal_px=260", "video.max_blur_samples=4"])}


def walk_row(name, variant, truth, poses, keyframes, claims):
    f = figures(truth, poses, keyframes)
    print(f"| {name} | {variant} | {claims['verdict']} | {f['path_m']:.1f} | {f['rmse_4_m']:.3f} | "
          f"{f['scale_%']:+.2f} | {f['end_%']:.3f} | {f['nees']:.2f} | "
          f"{claims.get('loops', {}).get('closed', 0)} |", flush=True)


def walk(camgyro, name, folder):
    scenario, settings = WALKS[name]
    recording = folder / name
    run(camgyro, "simulate", SOURCE / f"tools/scenarios/{scenario}.yaml", *settings,
        f"--out={recording}").check_returncode()
    if "video.format=mp4" in settings:  # tracked once for all that follows
        run(camgyro, "track", recording, f"--out={recording}").check_returncode()
    truth = Truth(recording / "truth_trajectory.tum")
    run(camgyro, "calibrate", recording, f"--out={folder}/cal_{name}").check_returncode()
    calibration = folder / f"cal_{name}/calibration.yaml"
    held(calibration, 0, 0, folder / "zero.yaml")
    for variant, used in (("calibrated", calibration), ("ignored", folder / "zero.yaml")):
        out = folder / f"{name}_{variant}"
        answer = run(camgyro, "odometry", recording, f"--calibration={used}", f"--out={out}")
        if not (out / "keyframes.csv").exists():
            print(f"| {name} | {variant} | " + answer.stdout.strip().splitlines()[-1] + " |" * 7,
                  flush=True)
            continue
        claims = yaml.safe_load((out / "odometry.yaml").read_text(encoding="utf-8"))
        keyframes = Poses(out / "keyframes.csv")
        walk_row(name, variant, truth, Poses(out / "trajectory.csv"), keyframes,
                 {"verdict": claims["verdict"]})
        if (out / "closed.csv").exists():
            walk_row(name, variant + ", loops", truth, Poses(out / "closed.csv"), keyframes, claims)


def walks(camgyro):
    print("| Walk | clock | verdict | path [m] | rmse [m] | scale [%] | end [%] | NEES | loops |\n|"
          + " --- |" * 9, flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        for name in WALKS:
            walk(camgyro, name, pathlib.Path(temporary))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", nargs="?", type=pathlib.Path,
                        default=SOURCE / "build/release/tools/camgyro",
                        help="the program (default: %(default)s)")
    parser.add_argument("--walks", action="store_true",
                        help="the simulated walks of table 1 instead")
    options = parser.parse_args()
    camgyro = options.camgyro.resolve()
    if options.walks:
        walks(camgyro)
        return
    print("| Recording | clock | verdict | path [m] | online [m] | window [m] | scale [%] | "
          "5 m [%] | end [%] | NEES | frames/s |\n|" + " --- |" * 11, flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for name in RECORDINGS:
            recording, result = DATA / name, folder / name
            truth = Truth(recording / "truth_trajectory.tum")
            run(camgyro, "calibrate", recording, EFFECTS, f"--out={result}").check_returncode()
            calibration = result / "calibration.yaml"
            row(camgyro, truth, recording, "calibrated", calibration, folder)
            rectified = folder / f"rectified_{name}"
            run(camgyro, "rectify", recording, f"--calibration={calibration}",
                f"--out={rectified}").check_returncode()
            held(calibration, 0, 0, folder / "zero.yaml")
            row(camgyro, truth, rectified, "rectified", folder / "zero.yaml", folder)
            found = run(camgyro, "delay", recording, f"--out={folder}/delay_{name}").stdout
            middle = float(re.search(r"([-\d.]+) ms by \d+ rotations", found).group(1))
            held(calibration, 1e-3 * middle, 0, folder / "searched.yaml")
            row(camgyro, truth, recording, "searched", folder / "searched.yaml", folder)
            row(camgyro, truth, recording, "ignored", folder / "zero.yaml", folder)


if __name__ == "__main__":
    main()
