"""What commands exit with; what else they have to say is theirs."""

from signal import SIGINT

UNRECORDED = 1
"""The run is whole, but a recording or a picture of it could not be written."""
MISTAKE = 2
"""A user's mistake, named on standard error."""
LOST = 6
"""Of a replay in a finished map: at the end it was not known where the robot is. 3 to 5 are `Outcome`'s."""
INTERRUPTED = 128
"""What a signal's number is added to."""
CTRL_C = INTERRUPTED + int(SIGINT)
"""Where nothing was worth waiting for."""
