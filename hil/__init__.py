"""The bench: sessions with a robot on CAN, real or virtual."""

from hil.compiled import use

use()
