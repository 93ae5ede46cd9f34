"""How a bag is written: every number of the recorder, validated once."""

from dataclasses import dataclass
from enum import Enum

from walk_optimizer.recording.errors import RecordingSettingsError


class Compression(Enum):
    """Compression of the chunks of a bag file."""

    NONE = "none"
    ZSTD = "zstd"
    LZ4 = "lz4"


@dataclass(frozen=True)
class RecorderSettings:
    """Settings of a recording.

    Attributes:
        compression: Compression of the chunks.
        chunk_bytes: Size at which a chunk is closed, before compression, in [byte]. What a killed
            process loses is the open chunk, so it is far smaller than the 1 MiB of the MCAP library.
        max_file_bytes: Size at which the next file of the bag is begun, in [byte]; 0 for one file.
        max_file_duration: Span of log times after which the next file is begun, in [s]; 0 for one
            file.
        flush_period: Time between two syncs to the disk, in [s].
        close_chunk_on_flush: Whether a sync closes the open chunk first, so that a crash loses at
            most `flush_period` of messages, at the price of smaller chunks.
        min_free_bytes: Free disk space below which the recording ends, in [byte]; 0 for no limit.
        queue_messages: Messages that may wait for the disk before further ones are dropped.
    """

    compression: Compression = Compression.NONE
    chunk_bytes: int = 64 * 1024
    max_file_bytes: int = 0
    max_file_duration: float = 0.0
    flush_period: float = 1.0
    close_chunk_on_flush: bool = True
    min_free_bytes: int = 256 * 1024 * 1024
    queue_messages: int = 20_000

    def __post_init__(self) -> None:
        """Refuse values out of range.

        Raises:
            RecordingSettingsError: With the name, the value and the range of the setting.
        """
        if self.compression not in tuple(Compression):
            names = ", ".join(choice.value for choice in Compression)
            raise RecordingSettingsError(f"compression is {self.compression!r}, must be one of {names}")
        self._require("chunk_bytes", self.chunk_bytes, 1024, 1 << 30)
        self._require("max_file_bytes", self.max_file_bytes, 0, 1 << 62)
        self._require("max_file_duration", self.max_file_duration, 0.0, 1e9)
        self._require("flush_period", self.flush_period, 1e-3, 1e6)
        self._require("min_free_bytes", self.min_free_bytes, 0, 1 << 62)
        self._require("queue_messages", self.queue_messages, 1, 10_000_000)

    @staticmethod
    def _require(name: str, value: float, lowest: float, highest: float) -> None:
        # Written so that NaN, which compares false with everything, is refused too.
        if not lowest <= value <= highest:
            raise RecordingSettingsError(f"{name} is {value!r}, must be in [{lowest}, {highest}]")
