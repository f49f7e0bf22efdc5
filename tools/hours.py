#!/usr/bin/python3
"""The library's Calibrator over hours of stream (timing/hours.cc) whose delay drifts. Prints the
tables of docs/lab/hours.md and draws its figures:

    tools/hours.py [--program build/release/timing/camgyro_hours] [--hours 2] [--rate 30]
                   [--jobs 1] [--folder FOLDER] [--figures docs/lab] [STREAM...]

FOLDER keeps a csv file for each stream, which is used again if it is there. Needs matplotlib.
"""
import argparse
import math
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
COMMON = ["seed=1", "motion.rotation_rms_rad_s=[0.5,0.5,0.5]", "tracks.count=60",
          "tracks.noise_px=0.3", "gyro.accelerometer=false"]
# Beside motion_walking.yaml. Drifts are sums of a line and two tones (effect delay_wander).
STREAMS = {
    "constant": [],
    # From -20 to -45 ms and back, in 400 s each way: the clocks of an action camera.
    "action camera": ["camera.delay_s=-0.0325", "effects.delay_wander.amplitude_s=0.0125",
                      "effects.delay_wander.period_s=800"],
    # 20 to 30 ms in each minute: a flight controller beside a camera. The gyro has to run on.
    "flight controller": ["effects.clock_skew.ppm=417", "effects.delay_wander.amplitude_s=0.00067",
                          "effects.delay_wander.period_s=60", "margin_s=%g"],
    # The action camera's, with points that jump off their tracks by 20 px.
    "wrong points": ["camera.delay_s=-0.0325", "effects.delay_wander.amplitude_s=0.0125",
                     "effects.delay_wander.period_s=800", "tracks.outlier_fraction=0.15"],
}
COLOURS = {"constant": "#4d4d4d", "action camera": "#2166ac", "flight controller": "#b35806",
           "wrong points": "#762a83"}
NEEDED_MS = 0.5
SETTLED_S = 30.0  # errors count from then on


def run(program, stream, hours, rate_hz, folder):
    path = "%s/%s.csv" % (folder, stream.replace(" ", "_"))
    if not os.path.exists(path):
        drift = [word % (1.0 + 600e-6 * 3600 * hours) if "%" in word else word
                 for word in STREAMS[stream]]
        with open(path + ".part", "w", encoding="utf-8") as out:
            subprocess.run([program, SOURCE + "/tools/scenarios/motion_walking.yaml",
                            "duration_s=%g" % (3600 * hours), "camera.rate_hz=%g" % rate_hz, *COMMON,
                            *drift], check=True, stdout=out)
        os.rename(path + ".part", path)
    return np.genfromtxt(path, delimiter=",", names=True)


def table(results):
    print("| Stream | delay moves [ms] | with an estimate | error, rms [ms] | largest [ms] | "
          "within %.1f ms | within 1, 2, 3 sigma | within 2 sigma in all | searches for a start |"
          % NEEDED_MS)
    print("| --- " * 9 + "|")
    for name, rows in results.items():
        late = rows[rows["time_s"] > SETTLED_S]
        known = late[np.isfinite(late["estimate_ms"])]
        error = np.abs(known["estimate_ms"] - known["delay_ms"])
        shares = [np.mean(error <= k * known["sigma_ms"]) for k in (1, 2, 3)]
        total = np.mean(error <= 2 * known["sigma_total_ms"])
        print("| %s | %.1f to %.1f | %.1f %% | %.3f | %.3f | %.1f %% | %s | %.1f %% | %d |" % (
            name, rows["delay_ms"].min(), rows["delay_ms"].max(), 100 * len(known) / len(late),
            math.sqrt(np.mean(error**2)), error.max(), 100 * np.mean(error <= NEEDED_MS),
            ", ".join("%.0f %%" % (100 * share) for share in shares), 100 * total,
            rows["starts"][-1]))
    print("\n| Stream | per frame, first and last tenth [ms of the processor] | largest "
          "[ms] | memory, first and last tenth [MB] |")
    print("| --- " * 4 + "|")
    for name, rows in results.items():
        tenth = max(1, len(rows) // 10)
        first, last = rows[rows["time_s"] > SETTLED_S][:tenth], rows[-tenth:]
        print("| %s | %.2f, %.2f | %.0f | %.1f, %.1f |" % (
            name, first["frame_ms"].mean(), last["frame_ms"].mean(), rows["frame_max_ms"].max(),
            first["resident_mb"].mean(), last["resident_mb"].mean()))


def means(values, count):
    """Of as many stretches."""
    return np.array([np.nanmean(part) for part in np.array_split(values, count)])


def draw_cost(results, path):
    figure, (frame, memory) = plt.subplots(2, 1, figsize=(7, 4), sharex=True)
    for name, rows in results.items():
        count = max(1, int(rows["time_s"][-1] / 60))
        minutes = means(rows["time_s"], count) / 60
        frame.plot(minutes, means(rows["frame_ms"], count), color=COLOURS[name], label=name, lw=1)
        memory.plot(minutes, means(rows["resident_mb"], count), color=COLOURS[name], lw=1)
    frame.set_ylabel("per frame [ms]")
    memory.set_ylabel("memory [MB]")
    memory.set_xlabel("time of the stream [min]")
    frame.set_ylim(bottom=0)
    memory.set_ylim(bottom=0)
    frame.legend(frameon=False, ncol=3)
    save(figure, path)


def draw_delay(results, path):
    figure, axes = plt.subplots(len(results), 1, figsize=(7, 1.9 * len(results)), sharex=True,
                                squeeze=False)
    for ax, (name, rows) in zip(axes[:, 0], results.items()):
        # A point in four seconds is enough for the eye.
        rows = rows[rows["time_s"] > SETTLED_S][::4]
        error = rows["estimate_ms"] - rows["delay_ms"]
        minutes = rows["time_s"] / 60
        ax.fill_between(minutes, -2 * rows["sigma_ms"], 2 * rows["sigma_ms"], color="0.85", lw=0)
        ax.plot(minutes, error, color=COLOURS[name], lw=0.5)
        for side in (-NEEDED_MS, NEEDED_MS):
            ax.axhline(side, color="k", lw=0.5, ls=":")
        ax.set_ylabel("error [ms]")
        ax.set_title(name, fontsize=9)
        most = np.nanmax(np.abs(error)) if len(error) else 1.0
        ax.set_ylim(-max(0.6, min(most, 1e3)), max(0.6, min(most, 1e3)))
    axes[-1, 0].set_xlabel("time of the stream [min]")
    save(figure, path)


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("streams", nargs="*", metavar="STREAM", help=", ".join(STREAMS))
    parser.add_argument("--program", default=SOURCE + "/build/release/timing/camgyro_hours")
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--rate", type=float, default=30.0, help="frames/s")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--folder")
    parser.add_argument("--figures", default=SOURCE + "/docs/lab", help="empty: draws none")
    options = parser.parse_args()
    plt.rcParams.update({"font.size": 9, "svg.hashsalt": "camgyro", "path.simplify": True})
    streams = options.streams or list(STREAMS)
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or temporary
        os.makedirs(folder, exist_ok=True)
        with ThreadPoolExecutor(options.jobs) as pool:
            found = pool.map(lambda stream: run(options.program, stream, options.hours,
                                                options.rate, folder), streams)
            results = dict(zip(streams, found))
    table(results)
    if options.figures:
        draw_cost(results, options.figures + "/hours_cost.svg")
        draw_delay(results, options.figures + "/hours_delay.svg")


if __name__ == "__main__":
    main()
