"""What one loop of the emulated laboratory costs: 18 s of physics and protocol, 51 images at 1280 x 960, tracked.

Run as a script: processor time, because other programs do not change it.
"""

import time

import cv2

from turing_learning.robots import EmulatedLaboratory, EPuck, Model, Tracker

LOOPS = 20


def main():
    cv2.setNumThreads(1)
    laboratory = EmulatedLaboratory(seed=1)
    replicas = [EPuck(laboratory.link(name)) for name in laboratory.names[-2:]]
    tracker = Tracker(laboratory.markers, laboratory.calibration, laboratory.labels)
    laboratory.operator.press_remote()
    laboratory.camera.take()
    spent = {"waiting (robots, physics, lines)": 0.0, "rendering": 0.0, "tracking": 0.0}
    faults = 0
    for sequence in range(LOOPS + 1):
        began = time.process_time()
        for replica in replicas:
            replica.wait_for("STOP", 20)
        for replica in replicas:
            replica.send_model(Model(sequence, (-0.7, -1.0, 1.0, -1.0)))
        for replica in replicas:
            replica.wait_for("START", 20)
        laboratory.clock.sleep(2.0)
        waited, began = time.process_time() - began, time.process_time()
        images = [laboratory.camera.take() for _ in range(51)]
        rendered, began = time.process_time() - began, time.process_time()
        faults += len(tracker.track(images).faults)
        tracked = time.process_time() - began
        if sequence:  # the first one warms up
            for name, seconds in zip(spent, (waited, rendered, tracked), strict=True):
                spent[name] += seconds
    for name, seconds in spent.items():
        print(f"{name:36} {1000 * seconds / LOOPS:7.1f} ms in a loop")
    total = sum(spent.values()) / LOOPS
    print(
        f"{'total':36} {1000 * total:7.1f} ms in a loop; 100 generations of 10: {1000 * total / 60:.1f} min; faults {faults}"
    )


if __name__ == "__main__":
    main()
