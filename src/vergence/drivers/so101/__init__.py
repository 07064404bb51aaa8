"""The SO-100 and SO-101 arms and others of Feetech's serial bus servos."""

from vergence.drivers.so101.so101 import So101

__all__ = ["So101"]
