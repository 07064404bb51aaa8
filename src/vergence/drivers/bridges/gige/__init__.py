"""A program for the Python that has Aravis: it joins a GigE Vision camera to the source `gige`.

It needs nothing but Aravis and PyGObject, packages of the system.
"""

__all__: list[str] = []
