"""Errors of a calibration.yaml beside the truth.yaml of a simulated recording."""
import numpy as np

NAMES = ("f", "c_x", "c_y", "t_r", "t_d", "b_x", "b_y", "b_z", "q_x", "q_y", "q_z")


def multiply(a, b):
    """Product of two quaternions (w, x, y, z)."""
    (w, x, y, z), (p, q, r, s) = a, b
    return np.array([w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r,
                     w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p])


def errors(calibration, truth):
    """Errors of NAMES [px, s, rad/s, rad about the camera's axes] and their sigmas, (11) each."""
    def parts(c, key):
        return [c["camera"]["focal_px"][key], *c["camera"]["principal_px"][key],
                c["shutter"]["readout_s"][key], c["clock"]["delay_s"][key],
                *c["gyro"]["bias_rad_s"][key]]
    inverse = np.array(truth["extrinsics"]["q_gyro_cam_wxyz"]["value"]) * [1, -1, -1, -1]
    rotation = multiply(inverse, calibration["extrinsics"]["q_gyro_cam_wxyz"]["value"])
    rotation = 2 * rotation[1:] * np.sign(rotation[0])
    return (np.append(np.subtract(parts(calibration, "value"), parts(truth, "value")), rotation),
            np.append(parts(calibration, "sigma"),
                      calibration["extrinsics"]["q_gyro_cam_wxyz"]["sigma_rad"]))
