"""What can go wrong with a bag, one class per case a caller may want to tell apart."""

from walk_optimizer.errors import ConfigurationError, WalkOptimizerError


class RecordingError(WalkOptimizerError):
    """Base of every error about recording, reading or repairing bags."""


class RecordingSettingsError(RecordingError, ConfigurationError):
    """A recorder setting lies outside of its range."""


class AlreadyRecordingError(RecordingError):
    """There is a recording already, and at most one at a time."""


class NotRecordingError(RecordingError):
    """There is no recording that could be stopped."""


class BagExistsError(RecordingError):
    """The directory to record into is already there; bags are never overwritten."""


class BagNotWritableError(RecordingError):
    """The bag cannot be created or written at the place that was asked for."""


class DiskFullError(RecordingError):
    """The disk is full, or has less free space than the recorder must leave."""


class TopicError(RecordingError):
    """A topic is unknown, or known with another type."""


class MessageError(RecordingError):
    """A message cannot be stored: its bytes or its time are not what a bag takes."""


class MessageDefinitionError(RecordingError):
    """The definition or the type hash of a message type was not found where ROS installs it."""


class NotABagError(RecordingError):
    """The path is no bag that can be read: missing, of another format, or beyond recognition."""


class CompressedBagError(NotABagError):
    """The bag was compressed by rosbag2 in a way that its .mcap files do not show."""


class ForeignTopicError(RecordingError):
    """A topic of a file that was not written by ROS 2, and that can't be repaired or played as one of it."""
