#!/usr/bin/python3
"""Runs `camgyro diagnose` on every measured recording; writes docs/lab/closed_loop.md with plots.

    tools/closed_loop.py [path of camgyro] [recording...]
    tools/closed_loop.py --times FOLDER

Of recordings that are not named the document keeps its rows. They lie in $CAMGYRO_DATA (default:
../shared/data beside the source). docs/lab/closed_loop_notes.md, the stories, is put in front of the
tables word by word.
"""
import argparse
import csv
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

import matplotlib
import numpy as np
import yaml

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(SOURCE, "tools"))
from measure import DATA, RECORDINGS  # noqa: E402

# Recordings as they are; the lens of ov_* and euroc-* is not declared.
NAMES = [name for name, variant, _ in RECORDINGS if not variant]
OF_ATTITUDES = ("tablet-attitude", "tango-walk", "arkit-attitude")
TIMES_FILE = "closed_loop_edge_times.svg"
BEFORE, AFTER = "#b35806", "#2166ac"  # told apart by colour-blind people and in grey


def diagnose(camgyro, name, folder):
    out = os.path.join(folder, name.replace("/", "_"))
    begin = time.time()
    run = subprocess.run([camgyro, "diagnose", os.path.join(DATA, name), "--out", out, "--quiet"],
                         capture_output=True, text=True)
    result = dict(name=name, exit=run.returncode, seconds=time.time() - begin, out=out,
                  error=run.stderr.strip().splitlines()[-1:] or [""])
    for key in ("diagnosis", "calibration", "calibration_before"):
        path = os.path.join(out, key + ".yaml")
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                result[key] = yaml.safe_load(file)
    print(name, run.returncode, "%.0f s" % result["seconds"],
          result.get("diagnosis", {}).get("verdict"), flush=True)
    return result


def number(value):
    return "%.4g" % value


def before_after(rounds, key, scale=1.0):
    """First and last value in frames that neither fit nor choice has seen, with each round's own
    noise: before the first effect, after the last."""
    added = [r for r in rounds if r["added"] != "none" and "withdrawn" not in r]
    if not added:
        return "%s" % number(scale * rounds[-1][key]["before"]) if rounds else ""
    return " → ".join([number(scale * added[0][key]["before"])] +
                      [number(scale * r[key]["after"]) for r in added])


def row(result):
    d = result.get("diagnosis")
    if d is None:
        return [result["name"], str(result["exit"]), "", "", "", "", result["error"][0]]
    verdict = d["verdict"]
    said = []
    if verdict.get("unconfirmed"):
        said.append("not confirmed: " + ", ".join(verdict["unconfirmed"]))
    said += ["withdrawn: " + r["added"] for r in d["rounds"] if "withdrawn" in r]
    if verdict["unexplained_structure"]:
        said.append("structure is left: " + ", ".join(verdict["where"]))
    said += ["%s: %s" % (f["name"], f["finding"]) for f in d["faults"]]
    if "not_tested" in verdict:
        said.append(verdict["not_tested"])
    if "refusal" in verdict:
        said.append("refused: " + verdict["refusal"])
    if verdict["indistinguishable"]:
        said.append("cannot tell apart: " + "; ".join(", ".join(a)
                                                      for a in verdict["indistinguishable"]))
    rounds = d["rounds"]
    scale = 1e3 if result["name"].startswith(OF_ATTITUDES) else 1.0
    gains = ", ".join("%.0f ± %.0f" % (r["unseen_gain"]["value"], r["unseen_gain"]["sigma"])
                      for r in rounds if r["added"] != "none" and "withdrawn" not in r)
    return [result["name"], str(result["exit"]), ", ".join(verdict["effects"]) or "none",
            before_after(rounds, "unseen_rms_px", scale), before_after(rounds, "unseen_chi2"),
            gains, "; ".join(said) or "nothing left"]


def kept_rows(text, head, names):
    """Rows of a table of the document as it is, by recording, without those of `names`."""
    kept = {}
    lines = iter(text.splitlines())
    for line in lines:
        if line == "| " + " | ".join(head) + " |":
            next(lines)
            for line in lines:
                if not line.startswith("| "):
                    return kept
                name = line[2:].split(" | ")[0]
                if name not in names:
                    kept.setdefault(name, []).append(line[2:-2].split(" | "))
    return kept


def merged(text, head, results, rows_of):
    """The rows of these results and those that the document has of other recordings."""
    rows = kept_rows(text, head, [r["name"] for r in results])
    for result in results:
        rows[result["name"]] = rows_of(result)
    return table(head, [row for name in NAMES for row in rows.get(name, [])])


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join(["---"] * len(head)) + " |"]
    lines += ["| " + " | ".join(r) + " |" for r in rows]
    return "\n".join(lines) + "\n"


def parameters(result):
    """Every effect's numbers, as the fit on all frames has them."""
    rows = []
    for effect in (result.get("calibration") or {}).get("effects", []):
        for p in effect["parameters"][:4]:
            rows.append([result["name"], effect["name"], p["name"],
                         "%.4g ± %.2g %s" % (p["value"], p["sigma"], p["unit"])])
    return rows


def state(result):
    """Delay, readout and focal length without and with the effects."""
    cells = [result["name"]]
    for key in ("calibration_before", "calibration"):
        c = result.get(key)
        if c is None:
            cells += ["", "", ""]
            continue
        show = lambda node, scale: "%.2f ± %.2f" % (scale * node["value"], scale * node["sigma"])
        cells += [show(c["camera"]["focal_px"], 1.0), show(c["shutter"]["readout_s"], 1e3),
                  show(c["clock"]["delay_s"], 1e3)]
    return cells


def maps(result, name):
    """{'before'|'after': [(axis, part, value, sigma)]} of one map."""
    found = {"before": [], "after": []}
    path = os.path.join(result["out"], "residual_maps.csv")
    if not os.path.exists(path):
        return found
    with open(path, encoding="utf-8") as file:
        for line in csv.DictReader(file):
            if line["map"] == name:
                found[line["#when"]].append(line)
    return found


def plot_over_axis(results, name, map_name, parts, scale, labels, file):
    result = next((r for r in results if r["name"] == name), None)
    if result is None or "calibration" not in result:
        return
    data = maps(result, map_name)
    figure, axes = plt.subplots(1, len(parts), figsize=(3.4 * len(parts), 3), sharey=True,
                                layout="constrained", squeeze=False)
    for axis, part in zip(axes[0], parts):
        for when, colour, shape in (("before", BEFORE, "o--"), ("after", AFTER, "s-")):
            points = []
            for line in data[when]:
                at, _, which = line["axis"].partition("/")
                if which == part and float(line["sigma"]) < 0.9 * max(
                        float(x["sigma"]) for x in data[when]) or which == part and part:
                    points.append((float(at), scale * float(line["value"])))
            if points:
                axis.plot(*zip(*sorted(points)), shape, color=colour, label=when, markersize=4)
        axis.axhline(0, color="0.6", linewidth=0.8)
        axis.set_xlabel(labels[0])
        axis.set_title(part and "about gyro " + part)
    axes[0][0].set_ylabel(labels[1])
    axes[0][0].legend(frameon=False)
    figure.suptitle("%s: %s" % (name, map_name))
    figure.savefig(os.path.join(SOURCE, "docs/lab", file), metadata={"Date": None})
    plt.close(figure)


def plot_image(results, name, file):
    result = next((r for r in results if r["name"] == name), None)
    if result is None or "calibration" not in result:
        return
    data = maps(result, "shift over the image")
    width, height = result["calibration"]["camera"]["resolution"]
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), sharey=True, layout="constrained")
    longest = 1e-9
    fields = {}
    for when in ("before", "after"):
        cells = {}
        for line in data[when]:
            cells.setdefault((int(line["row"]), int(line["column"])), {})[line["axis"]] = float(
                line["value"])
        fields[when] = cells
        longest = max([longest] + [math.hypot(c["x"], c["y"]) for c in cells.values()])
    for axis, when in zip(axes, ("before", "after")):
        rows = 1 + max(r for r, _ in fields[when])
        columns = 1 + max(c for _, c in fields[when])
        at = [(c * width / (columns - 1), r * height / (rows - 1)) for r, c in fields[when]]
        shift = [(v["x"], v["y"]) for v in fields[when].values()]
        axis.quiver(*zip(*at), *zip(*shift), angles="xy", scale_units="xy",
                    scale=longest / (0.12 * width), color=BEFORE if when == "before" else AFTER)
        axis.set_xlim(-0.12 * width, 1.12 * width)
        axis.set_ylim(1.12 * height, -0.12 * height)
        axis.set_aspect("equal")
        axis.set_title("%s (longest arrow %.2f px)" % (
            when, max(math.hypot(*s) for s in shift)))
        axis.set_xlabel("u [px]")
    axes[0].set_ylabel("v [px]")
    figure.suptitle(name + ": shift over the image that the model lacks")
    figure.savefig(os.path.join(SOURCE, "docs/lab", file), metadata={"Date": None})
    plt.close(figure)


def plot_lens(results, file):
    """Radial profile of euroc's lens as found, against two published calibrations of this camera,
    up to one scale each, which is f's. Returns a sentence with the numbers."""
    result = next((r for r in results if r["name"] == "euroc-v101-flight"), None)
    if result is None or "calibration" not in result:
        return ""
    camera = result["calibration"]["camera"]
    if camera["distortion"]["model"] != "kannala_brandt":
        return ""
    angle = np.linspace(0.01, 0.75, 75)  # to the corners of the picture
    tangent = np.tan(angle)
    k = camera["distortion"]["value"]
    found = camera["focal_px"]["value"] * sum(
        c * angle ** (2 * i + 1) for i, c in enumerate([1.0] + k))
    # original/cam0_sensor.yaml: fv, k1, k2
    radtan = 457.296 * tangent * (1 - 0.28340811 * tangent**2 + 0.07395907 * tangent**4)
    # Basalt (gitlab.com/VladyslavUsenko/basalt), data/euroc_ds_calib.json: fy, xi, alpha
    fy, xi, alpha = 348.72454229977037, -0.2409573942178872, 0.566996899163044
    shifted = xi + np.cos(angle)
    sphere = fy * np.sin(angle) / (alpha * np.hypot(np.sin(angle), shifted) +
                                   (1 - alpha) * shifted)
    figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
    said = []
    for profile, colour, label in ((radtan, BEFORE, "published, radtan"),
                                   (found, AFTER, "found, kannala_brandt")):
        scale = profile @ sphere / (sphere @ sphere)
        left = profile / scale - sphere
        axis.plot(np.degrees(angle), left, color=colour, label=label)
        said.append("%s: scale %.4f, largest difference %.2f px" % (
            label, scale, np.abs(left).max()))
    axis.axhline(0, color="0.6", linewidth=0.8)
    axis.set_xlabel("angle from the axis [deg]")
    axis.set_ylabel("radius, less that of\nBasalt's double sphere [px]")
    axis.legend(frameon=False)
    figure.suptitle("euroc-v101-flight: two calibrations against a third")
    figure.savefig(os.path.join(SOURCE, "docs/lab", file), metadata={"Date": None})
    plt.close(figure)
    return "Against Basalt's double sphere calibration of euroc's camera: %s.\n" % "; ".join(said)


def level_of(times_s, half=10):
    """Of each time: the median of its neighbours', moved by the usual interval."""
    usual = np.median(np.diff(times_s))
    number = np.concatenate([[0], np.cumsum(np.maximum(1, np.round(np.diff(times_s) / usual)))])
    left = times_s - usual * number
    near = [slice(max(0, i - half), i + half + 1) for i in range(len(left))]
    return usual * number + np.array([np.median(left[n]) for n in near])


def plot_frame_times(results, name, file):
    """The times that frames have of their own, and how they move. Returns a sentence."""
    result = next((r for r in results if r["name"] == name), None)
    path = os.path.join(result["out"], "frame_times.csv") if result else ""
    if not os.path.exists(path):
        return ""
    data = np.genfromtxt(path, delimiter=",", dtype=np.int64, comments="#")
    origin = data[0, 0]
    stamp_s, own_s = 1e-9 * (data[:, 0] - origin), 1e-9 * (data[:, 1] - origin)
    level_s = level_of(stamp_s)
    late_ms, own_ms = 1e3 * (stamp_s - level_s), 1e3 * (own_s - level_s)
    known = 1e-6 * data[:, 2] < 0.5  # ms
    # Each of the frames that are known, by the median of eleven around it.
    slow_ms = np.array([np.median(own_ms[known][max(0, i - 5):i + 6]) for i in range(known.sum())])
    figure, axes = plt.subplots(2, 2, figsize=(9, 4.5), layout="constrained", sharex="col",
                                sharey="row", width_ratios=[4, 1])
    for (axis, counts), value, where, colour, label in (
            (axes[0], late_ms, late_ms == late_ms, BEFORE, "stamp, less the\nstamps' level [ms]"),
            (axes[1], own_ms, known, AFTER, "frame's own time, less\nthe stamps' level [ms]")):
        axis.plot(stamp_s[where], value[where], ".", color=colour, markersize=2,
                  rasterized=True)
        axis.set_ylabel(label)
        axis.set_ylim(-15, 15)
        axis.grid(color="0.9")
        counts.hist(slow_ms if where is known else value[where], np.arange(-15, 15.1, 0.5),
                    orientation="horizontal", color=colour)
    axes[1][0].set_xlabel("time [s]")
    axes[1][1].set_xlabel("frames")
    figure.suptitle(name + ": when frames were stamped, and when they were taken")
    figure.savefig(os.path.join(SOURCE, "docs/lab", file), metadata={"Date": None})
    plt.close(figure)
    centred = own_ms[known] - own_ms[known].mean()
    alike = [(centred[lag:] * centred[:-lag]).mean() / centred.var() for lag in (1, 10, 40, 80)]
    return ("Frames' own times in %s (the %d known to 0.5 ms): standard deviation %.1f ms around "
            "the stamps' level, of which %.1f ms move slowly (median of 11 frames); autocorrelation "
            "%.2f, %.2f, %.2f and %.2f over 1, 10, 40 and 80 frames. The stamps themselves: %.1f ms "
            "around their level (1.48 times the median distance).\n" % (
                name, known.sum(), centred.std(), slow_ms.std(), *alike,
                1.4826 * np.median(np.abs(late_ms))))


def write(results):
    """The document from what is there so far: a long run that is cut off leaves what it has."""
    results = sorted(results, key=lambda r: NAMES.index(r["name"]))
    with open(SOURCE + "/docs/lab/closed_loop.md", encoding="utf-8") as old:
        text = old.read()
    times = plot_frame_times(results, "phone-edge-hand", TIMES_FILE) or next(
        (line + "\n" for line in text.splitlines() if line.startswith("Frames' own times")), "")
    for name in ("D12", "D13"):
        plot_over_axis(results, "tablet-attitude/" + name,
                       "rate error over the angular acceleration", ["x", "y", "z"], 1e3,
                       ("slope of the rate [rad/s²]", "rate error [mrad/s]"),
                       "closed_loop_tablet_%s.svg" % name)
    plot_over_axis(results, "ov_handheld_rs_skew", "delay over time", [""], 1e3,
                   ("time [s]", "delay left [ms]"), "closed_loop_skew.svg")
    plot_image(results, "ov_handheld_rs", "closed_loop_ov.svg")
    plot_image(results, "euroc-v101-flight", "closed_loop_euroc.svg")
    lens = plot_lens(results, "closed_loop_lens.svg") or next(
        (line + "\n" for line in text.splitlines() if line.startswith("Against Basalt's")), "")
    head = ["Recording", "Exit", "Effects", "rms", "chi2/dof", "fall of chi2", "Left"]
    known = kept_rows(text, head, [])
    missing = [name for name in NAMES
               if name not in known and name not in [r["name"] for r in results]]
    with open(SOURCE + "/docs/lab/closed_loop.md", "w", encoding="utf-8") as out:
        out.write("# The closed loop on measured data\n\nMade by `tools/closed_loop.py`; the text "
                  "before the tables is `docs/lab/closed_loop_notes.md`.\n\n")
        with open(SOURCE + "/docs/lab/closed_loop_notes.md", encoding="utf-8") as notes:
            out.write(notes.read())
        out.write("\n## Before and after\n\nIn frames that neither the fit nor the choice of the "
                  "effect has seen; rms in px (of attitudes: mrad), chi2 per residual, both with "
                  "the noise of the fit before each effect; fall of chi2 ± its scatter between "
                  "stretches, one per effect.\n\n")
        out.write(merged(text, head, results, lambda r: [row(r)]))
        if missing:
            out.write("\nNot run: " + ", ".join(missing) + ".\n")
        out.write("\n## Size of the effects\n\nFrom the fit on all frames.\n\n")
        out.write(merged(text, ["Recording", "Effect", "Parameter", "Value"], results, parameters))
        out.write("\n" + lens + "\n" + times)
        out.write("\n## Calibration without and with the effects\n\n")
        out.write(merged(text, ["Recording", "f [px]", "t_r [ms]", "t_d [ms]", "f with", "t_r with",
                                "t_d with"], results,
                         lambda r: [state(r)] if "calibration_before" in r else []))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", nargs="?", default=SOURCE + "/build/release/tools/camgyro",
                        help="the program (default: %(default)s)")
    parser.add_argument("recordings", nargs="*", metavar="recording", help="default: all")
    parser.add_argument("--times", metavar="FOLDER", help="draw only the picture of frames' own "
                        "times, from what `camgyro calibrate phone-edge-hand --out FOLDER` wrote")
    options = parser.parse_args()
    unknown = set(options.recordings) - set(NAMES)
    if unknown:
        parser.error("unknown: %s; there are %s" % (", ".join(sorted(unknown)), ", ".join(NAMES)))
    plt.rcParams.update({"font.size": 9, "svg.hashsalt": "camgyro"})
    if options.times:
        print(plot_frame_times([dict(name="phone-edge-hand", out=options.times)],
                               "phone-edge-hand", TIMES_FILE))
        return
    camgyro, chosen = options.camgyro, options.recordings
    folder = tempfile.mkdtemp(prefix="closed_loop_")
    results = []
    with ThreadPoolExecutor(2) as pool:
        # The short ones, attitudes, first.
        order = sorted(NAMES, key=lambda name: ("gopro-hero5" in name, name.startswith("ov_"),
                                                not name.startswith(OF_ATTITUDES)))
        for done in as_completed([pool.submit(diagnose, camgyro, name, folder)
                                  for name in order if not chosen or name in chosen]):
            results.append(done.result())
            write(results)
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
