#!/usr/bin/env python3
"""Errors of trajectories of `camgyro odometry` against a known one.

TRUTH.tum: `time x y z qx qy qz qw` of the gyro (IMU) frame on the gyro's clock, z up. DIR: folders
that `camgyro odometry --out` has written. One row for the poses as they were known online
(trajectory.csv) and one for the keyframes as they left the window (keyframes.csv):

  rmse_4, rmse_6  position after the best alignment of position and yaw, and of all six [m]
  scale           length of the estimate over the truth's, less one, after alignment [%]
  rel_5m          position error gained along 5 m of the way, rms over all starts [%]
  yaw             rms after the alignment of rmse_4 [deg]
  end             distance of the last position from the truth, aligned at the first keyframe only,
                  in % of the path: the figure of Feng, Li & Dai's table 1
  nees            e' C^-1 e / 3 of the position with its claimed covariance, mean; e from alignment
                  at the first keyframe, where the covariance is zero by definition
"""
import argparse
import csv
import pathlib

import numpy as np


def quaternion_to_matrix(q):
    """(..., 4) of x, y, z, w -> (..., 3, 3)."""
    x, y, z, w = np.moveaxis(np.asarray(q), -1, 0)
    return np.stack([
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
        np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
        np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def yaw_of(R):
    """The turn about z that is nearest to each rotation [rad]."""
    return np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])


def about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


class Truth:
    def __init__(self, path):
        rows = np.loadtxt(path)
        # Epoch seconds leave 0.2 microseconds in a double: enough for walking.
        self.time_s, self.p, q = rows[:, 0], rows[:, 1:4], rows[:, 4:8].copy()
        q[1:] *= np.cumprod(np.where((q[1:] * q[:-1]).sum(-1) < 0, -1, 1))[:, None]  # no jumps
        self.q = q

    def at(self, time_s):
        """Between rows both are linear: a row of truth for every frame is enough for poses of the
        frames, whose times are a few microseconds off."""
        p, q = (np.stack([np.interp(time_s, self.time_s, x) for x in values.T], -1)
                for values in (self.p, self.q))
        return p, quaternion_to_matrix(q / np.linalg.norm(q, axis=-1, keepdims=True))


class Poses:
    def __init__(self, path):
        with open(path) as file:
            rows = list(csv.reader(file))
        names, data = rows[0], np.array([[float(x) for x in row] for row in rows[1:]])
        column = {name.split(" ")[0].lstrip("#"): i for i, name in enumerate(names)}
        self.time_s = np.array([int(row[0]) for row in rows[1:]]) * 1e-9
        self.segment = data[:, column["segment"]].astype(int)
        self.p = data[:, [column[k] for k in ("p_x", "p_y", "p_z")]]
        self.R = quaternion_to_matrix(data[:, [column[k] for k in ("q_x", "q_y", "q_z", "q_w")]])
        self.covariance = np.zeros((len(data), 3, 3))
        for i, a in enumerate(("px", "py", "pz")):
            for j, b in enumerate(("px", "py", "pz")[:i + 1]):
                self.covariance[:, i, j] = self.covariance[:, j, i] = data[:, column[f"cov_{a}_{b}"]]


def align(p, q, yaw_only):
    """R, t with R p + t nearest to q in the mean square."""
    mp, mq = p.mean(0), q.mean(0)
    H = (p - mp).T @ (q - mq)
    if yaw_only:
        R = about_z(np.arctan2(H[0, 1] - H[1, 0], H[0, 0] + H[1, 1]))
    else:
        U, _, Vt = np.linalg.svd(H)
        R = Vt.T @ np.diag([1, 1, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return R, mq - R @ mp


def rms(errors):
    return np.sqrt((errors ** 2).sum(-1).mean())


def relative_percent(estimate, truth_p, length_m):
    """Position error gained along length_m of the true way, yaw aligned at its start; rms [%]."""
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(truth_p, axis=0), axis=1))])
    errors = []
    for i in range(len(way)):
        j = np.searchsorted(way, way[i] + length_m)
        if j >= len(way):
            break
        turn = about_z(estimate["yaw_error"][i])
        errors.append(turn @ (estimate["p"][j] - estimate["p"][i]) - (truth_p[j] - truth_p[i]))
    return 100 * rms(np.array(errors)) / length_m if errors else np.nan


def figures(truth, poses, anchor):
    inside = (poses.time_s >= truth.time_s[0]) & (poses.time_s <= truth.time_s[-1])
    p, q = poses.p[inside], truth.at(poses.time_s[inside])
    R4, t4 = align(p, q[0], True)
    R6, t6 = align(p, q[0], False)
    moved = p @ R4.T + t4
    spread = np.linalg.norm(moved - moved.mean(0)) / np.linalg.norm(q[0] - q[0].mean(0))
    yaw = yaw_of(q[1] @ np.swapaxes(R4 @ poses.R[inside], -1, -2))
    # Aligned at the first keyframe.
    p0, R0 = truth.at(anchor.time_s[:1])
    turn = about_z(yaw_of(R0[0] @ anchor.R[0].T))
    error = (p - anchor.p[0]) @ turn.T + p0[0] - q[0]
    way_m = np.linalg.norm(np.diff(q[0], axis=0), axis=1).sum()
    covariance = turn @ poses.covariance[inside] @ turn.T
    known = np.array([np.linalg.eigvalsh(c)[0] > 1e-12 for c in covariance])
    nees = np.einsum("ni,nij,nj->n", error[known], np.linalg.inv(covariance[known]), error[known])
    yaw_error = yaw_of(q[1] @ np.swapaxes(poses.R[inside], -1, -2))
    return {"poses": inside.sum(), "path_m": way_m, "rmse_4_m": rms(moved - q[0]),
            "rmse_6_m": rms(p @ R6.T + t6 - q[0]), "scale_%": 100 * (spread - 1),
            "rel_5m_%": relative_percent({"p": p, "yaw_error": yaw_error}, q[0], 5.0),
            "yaw_deg": np.degrees(np.sqrt((yaw ** 2).mean())),
            "end_%": 100 * np.linalg.norm(error[-1]) / way_m, "nees": nees.mean() / 3}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truth", metavar="TRUTH.tum")
    parser.add_argument("folders", metavar="DIR", nargs="+", type=pathlib.Path)
    options = parser.parse_args()
    truth = Truth(options.truth)
    print("| result | poses | path [m] | rmse_4 [m] | rmse_6 [m] | scale [%] | rel_5m [%] | "
          "yaw [deg] | end [%] | nees |\n|" + " --- |" * 10)
    for folder in options.folders:
        keyframes = Poses(folder / "keyframes.csv")
        for name, poses in (("online", Poses(folder / "trajectory.csv")), ("window", keyframes)):
            f = figures(truth, poses, keyframes)
            print(f"| {folder.name}, {name} | {f['poses']} | {f['path_m']:.2f} | "
                  f"{f['rmse_4_m']:.4f} | {f['rmse_6_m']:.4f} | {f['scale_%']:+.3f} | "
                  f"{f['rel_5m_%']:.3f} | {f['yaw_deg']:.3f} | {f['end_%']:.3f} | "
                  f"{f['nees']:.2f} |")


if __name__ == "__main__":
    main()
