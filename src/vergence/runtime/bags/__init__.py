"""ROS 2 bags: exports of a recording, and images and joints from any bag."""

from vergence.runtime.bags.bag import COMPRESSED, IMAGE, Bag, BagImage, BagJoints, is_bag
from vergence.runtime.bags.bag_recording import BagRecording, read_bag
from vergence.runtime.bags.write_bag import write_bag

__all__ = [
    "COMPRESSED",
    "IMAGE",
    "Bag",
    "BagImage",
    "BagJoints",
    "BagRecording",
    "is_bag",
    "read_bag",
    "write_bag",
]
