"""What commands exit with; what else they have to say is theirs."""

from signal import SIGINT

UNRECORDED = 1
"""The run is whole, but a recording or a picture of it could not be written."""
MISTAKE = 2
"""A user's mistake, named on standard error."""
INTERRUPTED = 128
"""What a signal's number is added to."""
CTRL_C = INTERRUPTED + int(SIGINT)
"""Where nothing was worth waiting for."""
