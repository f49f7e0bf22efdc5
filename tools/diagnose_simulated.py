#!/usr/bin/python3
"""Simulates every effect, and clean recordings, diagnoses them, and writes
docs/diagnosis_simulated.md: which effect was named first, how large it was found.

    tools/diagnose_simulated.py [--seeds N] [--duration S] [--motions walking,running] [--jobs N]
                                [--camgyro PATH]

Sizes are those of tools/scenarios/effect_*.yaml.
"""
import argparse
import glob
import os
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

import yaml

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def run(options, case):
    scenario, motion, seed = case
    with tempfile.TemporaryDirectory() as folder:
        recording, out = folder + "/recording", folder + "/out"
        changes = ["seed=%d" % seed, "duration_s=%g" % options.duration, "motion.kind=" + motion]
        subprocess.run([options.camgyro, "simulate", scenario, *changes, "--out", recording],
                       check=True, stdout=subprocess.DEVNULL)
        begin = time.time()
        diagnosed = subprocess.run([options.camgyro, "diagnose", recording, "--out", out,
                                    "--quiet"], capture_output=True, text=True)
        result = dict(case=case, exit=diagnosed.returncode, seconds=time.time() - begin,
                      effects=[], first="", chi2="", unexplained=False, parameters="")
        if os.path.exists(out + "/diagnosis.yaml"):
            with open(out + "/diagnosis.yaml", encoding="utf-8") as file:
                diagnosis = yaml.safe_load(file)
            verdict, rounds = diagnosis["verdict"], diagnosis["rounds"]
            result["effects"] = verdict["effects"]
            result["unexplained"] = verdict["unexplained_structure"]
            if rounds and rounds[0]["added"] != "none":
                chosen = rounds[0]["candidates"][0]
                result["first"] = chosen["name"]
                result["chi2"] = "%.3f → %.3f" % (rounds[0]["unseen_chi2"]["before"],
                                                  rounds[0]["unseen_chi2"]["after"])
                result["parameters"] = ", ".join(
                    "%s %.3g ± %.2g %s" % (p["name"], p["value"], p["sigma"], p["unit"])
                    for p in chosen.get("parameters", [])[:3])
            elif verdict["effects"]:
                result["first"] = verdict["effects"][0]
    print(os.path.basename(scenario), motion, seed, result["effects"], result["parameters"],
          "unexplained" if result["unexplained"] else "", "%.0f s" % result["seconds"], flush=True)
    return result


def write(options, scenarios, results):
    with open(SOURCE + "/docs/diagnosis_simulated.md", "w", encoding="utf-8") as out:
        out.write("# The diagnosis of simulated recordings\n\nMade by `tools/diagnose_simulated.py "
                  "--seeds %d --duration %g --motions %s`: scenarios of `tools/scenarios`, the "
                  "effect not declared. `default` is clean. \"First\": runs in which the right "
                  "effect was the first added.\n\n" %
                  (options.seeds, options.duration, options.motions))
        out.write("| Scenario | Motion | First | Named | Unexplained | Found (first seed) | "
                  "Unseen chi2/dof (first seed) | Seconds |\n| --- | --- | --- | --- | --- | --- | "
                  "--- | --- |\n")
        for scenario in scenarios:
            for motion in options.motions.split(","):
                rows = [r for r in results if r["case"][:2] == (scenario, motion)]
                if not rows:
                    continue
                name = os.path.basename(scenario)[:-5]
                effect = name.replace("effect_", "")
                named = {}
                for r in rows:
                    key = ", ".join(r["effects"]) or "nothing"
                    named[key] = named.get(key, 0) + 1
                right = sum(r["first"] == effect or (effect == "default" and not r["effects"])
                            for r in rows)
                out.write("| %s | %s | %d of %d | %s | %d of %d | %s | %s | %.0f |\n" % (
                    name, motion, right, len(rows),
                    "; ".join("%s (%d)" % item for item in sorted(named.items())),
                    sum(r["unexplained"] for r in rows), len(rows), rows[0]["parameters"],
                    rows[0]["chi2"], sum(r["seconds"] for r in rows) / len(rows)))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--motions", default="walking,running")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    options = parser.parse_args()
    scenarios = sorted(glob.glob(SOURCE + "/tools/scenarios/effect_*.yaml"))
    scenarios.append(SOURCE + "/tools/scenarios/default.yaml")
    cases = [(s, m, seed) for s in scenarios for m in options.motions.split(",")
             for seed in range(1, options.seeds + 1)]
    results = []
    with ThreadPoolExecutor(options.jobs) as pool:
        for done in as_completed([pool.submit(run, options, case) for case in cases]):
            results.append(done.result())
            write(options, scenarios, sorted(results, key=lambda r: cases.index(r["case"])))


if __name__ == "__main__":
    main()
