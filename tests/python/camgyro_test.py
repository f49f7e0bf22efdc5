"""The Python module on a simulated recording. camgyro_test.py CAMGYRO_BINARY"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import camgyro
import numpy as np

SCENARIO = """
duration_s: 8
motion: {kind: walking, rotation_rms_rad_s: [0.5, 0.5, 0.5]}
tracks: {count: 50, noise_px: 0.3}
camera: {delay_s: 0.03}
"""


class CamgyroTest(unittest.TestCase):

  @classmethod
  def setUpClass(cls):
    cls.folder = tempfile.TemporaryDirectory()
    root = pathlib.Path(cls.folder.name)
    (root / 'scenario.yaml').write_text(SCENARIO)
    subprocess.run([BINARY, 'simulate', str(root / 'scenario.yaml'), '--out', str(root / 'r')],
                   check=True, stdout=subprocess.DEVNULL)
    cls.recording = camgyro.read_recording(str(root / 'r'))
    cls.report = camgyro.calibrate(cls.recording)

  @classmethod
  def tearDownClass(cls):
    cls.folder.cleanup()

  def test_recording_arrays(self):
    r = self.recording
    self.assertEqual(r.size, (720, 480))
    self.assertEqual(r.frame_stamps_ns.shape, (241,))
    self.assertEqual(r.frame_stamps_ns.dtype, np.int64)
    self.assertEqual(r.gyro_rad_s.shape, (len(r.gyro_stamps_ns), 3))
    self.assertEqual(r.accel_m_s2.shape, (len(r.accel_stamps_ns), 3))
    # A walk: gravity and steps.
    self.assertAlmostEqual(np.linalg.norm(r.accel_m_s2, axis=1).mean(), 9.8, delta=0.5)
    np.testing.assert_allclose(np.diff(r.gyro_stamps_ns), 5e6, atol=1)
    ids, pixels = r.tracks
    self.assertEqual(ids.shape, pixels.shape)
    self.assertEqual(ids[:, 0].max(), 240)
    self.assertTrue(((pixels > -1) & (pixels < 720)).all())
    self.assertIn('241 frames', repr(r))

  def test_one_device_from_two_recordings(self):
    # The same recording twice: no spread, and the information of both.
    device = camgyro.combine([(self.recording, self.report)] * 2)
    c = device.calibration
    self.assertAlmostEqual(c.focal_px, self.report.calibration.focal_px, delta=0.1)
    np.testing.assert_allclose(c.sigma[:4], self.report.calibration.sigma[:4] / np.sqrt(2),
                               rtol=0.05)
    self.assertEqual(device.repeatability['focal_px']['between'], 0.0)
    self.assertEqual(device.repeatability['delay_s']['recordings'], 2)
    self.assertEqual(device.odd, [])
    self.assertIn('recordings:', device.yaml())
    with self.assertRaises(camgyro.Error):
      camgyro.combine([])

  def test_calibration_is_the_truth_within_its_sigmas(self):
    c = self.report.calibration
    sigma = dict(zip(camgyro.Calibration.names, c.sigma))
    self.assertEqual(c.covariance.shape, (11, 11))
    np.testing.assert_allclose(np.sqrt(np.diag(c.covariance)), c.sigma)
    self.assertLess(np.linalg.eigvalsh(c.covariance / np.outer(c.sigma, c.sigma)).min(), 1.0)
    self.assertGreater(np.linalg.eigvalsh(c.covariance / np.outer(c.sigma, c.sigma)).min(), 0.0)
    self.assertLess(abs(c.focal_px - 650.0), 4.0 * c.sigma[0])
    self.assertLess(abs(c.readout_s - 0.02), 4.0 * c.sigma[3])
    self.assertLess(abs(c.delay_s - 0.03), 4.0 * c.sigma[4])
    self.assertLess(c.sigma[4], 5e-4)
    self.assertTrue(all(c.determined.values()))
    self.assertEqual(len(sigma), 11)
    np.testing.assert_allclose(c.R_gyro_cam @ c.R_gyro_cam.T, np.eye(3), atol=1e-12)
    w, x, y, z = c.q_gyro_cam
    self.assertAlmostEqual(c.R_gyro_cam[0, 0], 1 - 2 * (y * y + z * z), places=12)

  def test_calibration_yaml_is_read_back(self):
    path = pathlib.Path(self.folder.name) / 'calibration.yaml'
    path.write_text(self.report.yaml(self.recording))
    read, c = camgyro.read_calibration(str(path)), self.report.calibration
    np.testing.assert_allclose(read.sigma, c.sigma, rtol=1e-8)
    self.assertAlmostEqual(read.focal_px, c.focal_px, places=5)
    self.assertEqual(read.determined, c.determined)
    path.write_text('camera: {resolution: [640]}')
    with self.assertRaisesRegex(camgyro.Error, r'calibration.yaml.*focal_px'):
      camgyro.read_calibration(str(path))

  def test_trace_and_curve(self):
    trace = self.report.trace
    n = len(trace['frame_stamp_ns'])
    self.assertGreater(n, 5)
    self.assertEqual(trace['values'].shape, (n, 8))
    self.assertEqual(trace['sigmas'].shape, (n, 11))
    self.assertLess(trace['sigmas'][-1, 4], trace['sigmas'][0, 4])
    curve = self.report.delay_curve
    best = curve[curve[:, 1].argmin(), 0]
    self.assertAlmostEqual(best, 0.04, delta=0.01)  # of the middle row

  def test_vins(self):
    start = camgyro.initialise_vins(self.recording, self.report.calibration, first_s=1.0,
                                    p_gyro_cam_m=[0.03, 0.05, 0.0])
    self.assertEqual(start.verdict, 'ready', start.explanation)
    n = len(start.frame_stamps_ns)
    self.assertEqual(start.q_world_gyro.shape, (n, 4))
    self.assertEqual(start.covariance.shape, (9 * n + 20, 9 * n + 20))
    self.assertAlmostEqual(np.linalg.norm(start.gravity_m_s2), 9.80665, places=6)
    speed = np.linalg.norm(start.v_world_m_s, axis=1).mean()
    self.assertAlmostEqual(speed, 1.4, delta=0.25)  # of the scenario's path

  def test_odometry(self):
    run = camgyro.odometry(self.recording, self.report.calibration, p_gyro_cam_m=[0.03, 0.05, 0.0],
                           p_gyro_cam_sigma_m=0.01)
    self.assertEqual(run.verdict, 'tracked')
    self.assertEqual([e['event'] for e in run.events], ['started'])
    self.assertIn('no pictures', run.loops)
    self.assertIsNone(run.closed)
    poses, keyframes = run.poses, run.keyframes
    n = len(poses['time_ns'])
    self.assertGreater(n, 120)
    self.assertEqual(poses['frame_stamp_ns'].dtype, np.int64)
    self.assertEqual(poses['q_world_gyro'].shape, (n, 4))
    self.assertEqual(poses['covariance'].shape, (n, 15, 15))
    # A walk of 8 s at 1.2 m/s, as far as keyframes have left the window, and on the level.
    way = np.linalg.norm(np.diff(keyframes['p_world_m'], axis=0), axis=1).sum()
    self.assertAlmostEqual(way, run.path_m, places=9)
    self.assertAlmostEqual(np.linalg.norm(keyframes['v_world_m_s'], axis=1).mean(), 1.4, delta=0.25)
    sigma = np.sqrt(np.diagonal(poses['covariance'], axis1=1, axis2=2))
    self.assertTrue((sigma[1:, 3:6] > 0).all())
    self.assertLess(sigma[-1, 3:6].max(), 0.3)
    self.assertGreater(len(run.points_m), 50)
    self.assertLess(np.abs(run.p_gyro_cam_m - [0.03, 0.05, 0.0]).max(), 0.04)
    # At the gyro's rate the way goes through the keyframes.
    dense = run.at_gyro_rate(self.recording)
    self.assertTrue((np.diff(dense['time_ns']) > 0).all())
    inside = (keyframes['time_ns'] > dense['time_ns'][0]) & (
        keyframes['time_ns'] < dense['time_ns'][-1])
    for axis in range(3):
      there = np.interp(keyframes['time_ns'][inside], dense['time_ns'], dense['p_world_m'][:, axis])
      np.testing.assert_allclose(there, keyframes['p_world_m'][inside, axis], atol=1e-4)
    with self.assertRaises(camgyro.Error) as caught:
      camgyro.odometry(self.recording, self.report.calibration, keyframes=3)
    self.assertEqual(caught.exception.args[1], 2)

  def test_errors_are_exceptions_with_a_code(self):
    with self.assertRaises(camgyro.Error) as caught:
      camgyro.read_recording('/nowhere/at/all')
    message, code = caught.exception.args
    self.assertIn('/nowhere/at/all', message)
    self.assertEqual(code, 3)
    with self.assertRaises(camgyro.Error) as caught:
      camgyro.initialise_vins(self.recording, self.report.calibration, window_s=-1.0)
    self.assertEqual(caught.exception.args[1], 2)

  def test_everything_is_documented(self):
    for name in ('read_recording', 'calibrate', 'initialise_vins', 'odometry'):
      self.assertGreater(len(getattr(camgyro, name).__doc__), 80)
    self.assertIn('(samples, 3)', camgyro.Recording.gyro_rad_s.__doc__)
    self.assertIn('(11, 11)', camgyro.Calibration.covariance.__doc__)


if __name__ == '__main__':
  BINARY = sys.argv.pop(1)
  unittest.main()
