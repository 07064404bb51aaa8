"""Whether errors agree with their stated uncertainty."""

from vergence.studies.honesty.study import reproduce

__all__ = ["reproduce"]
