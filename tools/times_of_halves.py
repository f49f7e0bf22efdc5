#!/usr/bin/python3
"""tools/times_of_halves.py PROGRAM RECORDING...: where the errors of frames' own times come from.

Where frame stamps are arrival times, each frame has a time of its own in the fit, told by all of
its tracks. This calibrates each recording with half of its tracks, and with the other half: every
other track, whose halves share whatever shifts a part of the picture, and those of the left and of
the right side, which share what shifts all of it. Prints, per kind of halves, how far the times of
the same frames differ, in sigmas of the difference (median; 0.67 of errors that these sigmas know
and the halves do not share), once the median of 31 frames is taken off: what the halves have in
common for longer is the delay, which each half has by itself. The last column is how far the times
of all tracks lie from an even clock in the same way, in their sigmas: from the median of 31
frames, which a camera whose interval changes slowly follows.

RECORDING: a folder; where it has no cam0/tracks.csv, its pictures are tracked. PROGRAM: the camgyro
to run.
"""

import argparse
import collections
import pathlib
import subprocess
import tempfile

import numpy as np

FRAMES = 31  # of the running median


def less_running_median(values):
    half = FRAMES // 2
    return values - np.array(
        [np.median(values[max(0, i - half):i + half + 1]) for i in range(len(values))])


def read_tracks(file):
    lines = file.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    return head, [line for line in lines if line and not line.startswith("#")]


def halves_of(rows, width_px):
    """Name of the halves, and for each half the ids of its tracks."""
    columns = collections.defaultdict(list)
    for row in rows:
        _, track, u, _ = row.split(",")[:4]
        columns[track].append(float(u))
    left = {track for track, u in columns.items() if np.mean(u) < 0.5 * width_px}
    even = {track for track in columns if int(track) % 2 == 0}
    return {
        "every other track": (even, set(columns) - even),
        "left and right": (left, set(columns) - left)
    }


def tracks_of(program, recording, work):
    file = recording / "cam0" / "tracks.csv"
    if file.exists():
        return file
    subprocess.run([program, "track", recording, "--quiet", "--out", work / "tracked"], check=True)
    return work / "tracked" / "cam0" / "tracks.csv"


def frame_times(program, recording, out):
    """Recorded stamp -> (repaired stamp, sigma) [ns]."""
    result = subprocess.run(
        [program, "calibrate", recording, "--quiet", "--out", out],
        capture_output=True,
        text=True,
        check=False)
    file = out / "frame_times.csv"
    if not file.exists():
        raise SystemExit(f"{recording}: no frame_times.csv, expected frames with times of their own: "
                         f"{result.stderr.strip()}")
    table = np.loadtxt(file, delimiter=",", comments="#", dtype=np.int64, ndmin=2)
    return {stamp: (repaired, sigma) for stamp, repaired, sigma in table}


def with_tracks(recording, head, rows, folder):
    """The recording with these rows alone as its tracks."""
    folder.mkdir()
    for part in sorted(recording.iterdir()):
        if part.name != "cam0":
            (folder / part.name).symlink_to(part.resolve())
    (folder / "cam0").mkdir()
    for part in (recording / "cam0").iterdir():
        if part.name != "tracks.csv":
            (folder / "cam0" / part.name).symlink_to(part.resolve())
    (folder / "cam0" / "tracks.csv").write_text("\n".join(head + rows) + "\n")
    return folder


def columns_of(times, stamps):
    """Repaired stamps, from the first on, and their sigmas [ms]."""
    repaired, sigma = np.array([times[stamp] for stamp in stamps]).T
    return 1e-6 * (repaired - repaired[0]), 1e-6 * sigma


def measure(program, recording, work):
    head, rows = read_tracks(tracks_of(program, recording, work))
    width_px = max(float(row.split(",")[2]) for row in rows)
    count = 0

    def fit(tracks):
        nonlocal count
        count += 1
        kept = [row for row in rows if tracks is None or row.split(",")[1] in tracks]
        return frame_times(program, with_tracks(recording, head, kept, work / f"in{count}"),
                           work / f"out{count}")

    whole = fit(None)
    t_ms, sigma_ms = columns_of(whole, sorted(whole))
    interval_ms = np.median(np.diff(t_ms))
    off_ms = t_ms - interval_ms * np.round(t_ms / interval_ms)
    uneven = np.median(np.abs(less_running_median(off_ms)) / sigma_ms)
    for name, halves in halves_of(rows, width_px).items():
        times = [fit(half) for half in halves]
        common = sorted(set(times[0]) & set(times[1]))
        (first_ms, first_sigma), (second_ms, second_sigma) = (
            columns_of(of_half, common) for of_half in times)
        sigma = np.hypot(first_sigma, second_sigma)
        difference = less_running_median(first_ms - second_ms)
        print(f"| {recording.name} | {name} | {len(common)} | {np.median(sigma):.2f} | "
              f"{np.median(np.abs(difference) / sigma):.2f} | {uneven:.2f} |",
              flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("recording", type=pathlib.Path, nargs="+")
    args = parser.parse_args()
    print("| Recording | Halves | Frames | Sigma of their difference [ms] | Difference [sigmas] | "
          "All tracks, off an even clock [sigmas] |")
    print("| --- | --- | --- | --- | --- | --- |")
    for recording in args.recording:
        with tempfile.TemporaryDirectory() as work:
            measure(args.program.resolve(), recording, pathlib.Path(work))


if __name__ == "__main__":
    main()
