"""Write the files in `written/` by the programs that define their formats, from positions (F, A, 2) in pixels.

Not run by the tests: the programs are large. In an environment of its own:

    pip install sleap-io==0.9.5 movement==0.15.0 ndx-pose==0.4.0 pynwb==4.2.0 trackpy==0.7 scipy pandas
    python tests/unit/trajectories/data/write.py
"""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import sleap_io
import trackpy
from movement.io import load_bboxes, load_poses, save_bboxes, save_poses
from pynwb import NWBHDF5IO, NWBFile
from pynwb.behavior import Position, SpatialSeries
from scipy.io import savemat

FOLDER = Path(__file__).parent / "written"
FRAMES = 12
POINTS = ("thorax", "head")

rng = np.random.default_rng(0)
steps = rng.normal(0, 1, (FRAMES, 2, 2))
positions = np.round(np.array([[100, 100], [300, 200]]) + np.cumsum(steps, axis=0), 3)
positions[4:6, 1] = np.nan
FOLDER.mkdir(exist_ok=True)
for file in FOLDER.iterdir():
    file.unlink()  # movement writes over no file
np.save(FOLDER / "positions.npy", positions)

skeleton = sleap_io.Skeleton(list(POINTS), edges=[POINTS])
tracks = [sleap_io.Track(f"track_{who}") for who in range(2)]
video = sleap_io.Video(filename="video.mp4", open_backend=False)
labeled = []
for frame, present in enumerate(~np.isnan(positions[..., 0])):
    instances = [
        sleap_io.PredictedInstance.from_numpy(
            np.stack([positions[frame, who], positions[frame, who] + 1]),
            skeleton=skeleton,
            point_scores=np.array([0.9, 0.8]),
            score=0.95,
            track=tracks[who],
        )
        for who in np.flatnonzero(present)
    ]
    labeled.append(sleap_io.LabeledFrame(video=video, frame_idx=frame, instances=instances))
labels = sleap_io.Labels(labeled, videos=[video], skeletons=[skeleton], tracks=tracks)
sleap_io.save_analysis_h5(labels, str(FOLDER / "sleap-io.analysis.h5"))
for form in ("sleap", "dlc", "points", "instances"):
    sleap_io.save_csv(labels, str(FOLDER / f"sleap-io.{form}.csv"), format=form)

poses = load_poses.from_numpy(
    np.stack([positions, positions + 1], axis=2).transpose(0, 3, 2, 1),
    confidence_array=np.full((FRAMES, 2, 2), 0.9),
    individual_names=["a", "b"],
    keypoint_names=list(POINTS),
    fps=25,
    source_software="SLEAP",
)
poses.to_netcdf(FOLDER / "movement.nc")
save_poses.to_sleap_analysis_file(poses, str(FOLDER / "movement.sleap.h5"))
save_poses.to_dlc_file(poses, str(FOLDER / "movement.dlc.csv"), split_individuals=False)
save_poses.to_dlc_file(poses, str(FOLDER / "movement.dlc.h5"), split_individuals=False)
save_poses.to_lp_file(poses, str(FOLDER / "movement.lp.csv"))

frames, who = np.nonzero(~np.isnan(positions[..., 0]))
x, y = positions[frames, who].T
spots = pd.DataFrame({"y": y, "x": x, "mass": 5.0, "frame": frames})
linked = trackpy.link(spots, search_range=8, memory=5)
linked.to_csv(FOLDER / "trackpy.csv")
linked.to_csv(FOLDER / "trackpy.de.csv", sep=";", decimal=",", index=False)

savemat(FOLDER / "scipy.mat", {"trajectories": positions, "probtrajectories": positions[..., 0]})
np.savez(FOLDER / "numpy.npz", positions=positions, fps=25.0)

sleap_io.save_slp(labels, str(FOLDER / "sleap-io.slp"))
sleap_io.save_coco(labels, str(FOLDER / "sleap-io.coco.json"))

boxes = load_bboxes.from_numpy(
    positions.transpose(0, 2, 1),
    np.full((FRAMES, 2, 2), 6.0),
    confidence_array=np.full((FRAMES, 2), 0.9),
    individual_names=["id_1", "id_2"],
    fps=25,
)
save_bboxes.to_via_tracks_file(boxes, FOLDER / "movement.via.csv")

one_pose = poses.isel(individuals=[0])
nwb = save_poses.to_nwb_file(one_pose)
with NWBHDF5IO(FOLDER / "movement.nwb", mode="w") as file:
    file.write(nwb, cache_spec=False)

nwb = NWBFile("a session", "1", datetime(2026, 1, 1, tzinfo=UTC))
series = SpatialSeries(
    name="place", data=positions[:, 0] / 1000, reference_frame="corner", unit="meters", rate=25.0
)
module = nwb.create_processing_module("behavior", "processed")
module.add(Position(spatial_series=series))
with NWBHDF5IO(FOLDER / "pynwb.nwb", mode="w") as file:
    file.write(nwb, cache_spec=False)
