"""A GigE Vision camera on this computer's loopback, by Aravis; for the system's Python."""

import sys

import gi

gi.require_version("Aravis", "0.8")
from gi.repository import Aravis  # noqa: E402 - after the version is chosen

camera = Aravis.GvFakeCamera.new("lo", "GV01")
sys.stdout.write("ready\n")
sys.stdout.flush()
sys.stdin.read()
