"""Copies of recordings in the EuRoC layout with something changed: links where nothing is."""
import os


def copy_recording(recording, folder, keep=None, stamp=None, gyro=None, sensor=None):
    """Makes `folder` a copy of `recording`, changed by what is given, and returns it.

    keep(stamp): whether a frame stays; stamp(stamp): its stamp in the copy (integers, ns); rows
    about several frames stay if all do). gyro(index, row): the row in the copy, as a list of texts,
    or None; sensor(text): that of cam0/sensor.yaml.
    """
    for sub in sorted(os.listdir(recording)):
        source = os.path.join(os.path.abspath(recording), sub)
        if sub not in ("cam0", "imu0"):
            continue
        os.makedirs(os.path.join(folder, sub))
        for name in sorted(os.listdir(source)):
            path, target = os.path.join(source, name), os.path.join(folder, sub, name)
            if sub == "cam0" and name.endswith(".csv") and (keep or stamp):
                _write(target, _camera_rows(path, keep, stamp))
            elif sub == "imu0" and name == "data.csv" and gyro:
                _write(target, _gyro_rows(path, gyro))
            elif sub == "cam0" and name == "sensor.yaml" and sensor:
                with open(path, encoding="utf-8") as file:
                    _write(target, [sensor(file.read())])
            else:
                os.symlink(path, target)
    return folder


def frame_stamps(recording):
    """The stamps of all frames of a recording [ns], in their order."""
    camera = os.path.join(recording, "cam0")
    stamps = set()
    for name in os.listdir(camera):
        if name.endswith(".csv"):
            with open(os.path.join(camera, name), encoding="utf-8") as file:
                stamps.update(_ns(row.split(",", 1)[0]) for row in file if row[0].isdigit())
    return sorted(stamps)


def _ns(cell):
    return int(cell.split(".")[0])


def _write(path, rows):
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(rows)


def _camera_rows(path, keep, stamp):
    with open(path, encoding="utf-8") as file:
        stamps_per_row = 2 if file.readline().startswith("#timestamp_a") else 1
        file.seek(0)
        for row in file:
            if not row[0].isdigit():
                yield row
                continue
            cells = row.split(",")
            stamps = [_ns(cell) for cell in cells[:stamps_per_row]]
            if keep is None or all(keep(s) for s in stamps):
                if stamp is not None:
                    cells[:stamps_per_row] = [str(stamp(s)) for s in stamps]
                    end = "" if len(cells) > stamps_per_row else "\n"
                    row = ",".join(cells) + end
                yield row


def _gyro_rows(path, gyro):
    with open(path, encoding="utf-8") as file:
        index = 0
        for row in file:
            if not row[0].isdigit():
                yield row
                continue
            changed = gyro(index, row.rstrip("\r\n").split(","))
            index += 1
            if changed is not None:
                yield ",".join(changed) + "\n"
