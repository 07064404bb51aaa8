"""The recording of a run: written tick by tick as MCAP, read back as arrays.

Topics of a recording, where X is an arm or a camera; times are seconds since the start of the run:

| topic | type | holds |
|---|---|---|
| `/arm/X/state` | JSON | joints, set-points, command, camera twist, active limits |
| `/arm/X/joints` | foxglove.JointStates | joints under their names |
| `/camera/X/features` | JSON | points with covariance, desired and true points, true poses |
| `/camera/X/image` | foxglove.CompressedImage | every n-th image, JPEG |
| `/camera/X/annotations` | foxglove.ImageAnnotations | tracked, lost, desired and true points |
| `/camera/X/calibration` | foxglove.CameraCalibration | intrinsic parameters, once |
| `/target` | JSON | pose, velocity and covariance as estimated by a filter |
| `/target/X` | JSON | the same for a target X other than the task's |
| `/target/X/camera/Y/features` | JSON | its points in camera Y |
| `/tf` | foxglove.FrameTransforms | poses of camera, target and target estimate in the world |
| `/events` | foxglove.Log | single events |

Two metadata records: `vergence` (version, cell file, limits, cameras, seed) and `outcome`.
"""

from vergence.runtime.recording.outcome_json import outcome_json
from vergence.runtime.recording.recorder import Recorder
from vergence.runtime.recording.recording import Recording

__all__ = ["Recorder", "Recording", "outcome_json"]
