"""Before anything else an armed arm proves that it is what it is said to be: it stands still, and each joint turns its way."""

import numpy as np

from fmus.errors import MisfitError
from hil.control.controllers import Observed

# rad that a joint must turn, rad/s at which an arm drifts, and the longest test of a joint in s.
TURN, DRIFT, PATIENCE_S = 0.01, 0.05, 1.0
# s without torque first, and to come to rest after each joint; the latter with damping in N.m.s/rad.
STAND_S, REST_S, DAMPING = 1.0, 0.2, 1.0
# rad/s below which a joint stands.
STANDS = 0.01
# The speeds of the first moments are those of the arming.
SETTLE_S = 0.1


class Proof:
    """Asks for a slowly growing torque at one joint after the other, towards the middle of its range.

    Args:
        middles: (n,) rad, away from which no joint is pushed.
        most: (n,) N.m that the torques of the test grow to.
    """

    def __init__(self, middles: np.ndarray, most: np.ndarray) -> None:
        self.middles, self.most = middles, most
        self.joint, self.is_done = -1, False
        self._began, self._rest_until = 0.0, 0.0
        self._from = np.zeros_like(middles)

    def torque(self, observed: Observed) -> np.ndarray:
        """Torques (n,) in N.m of the test.

        Raises:
            MisfitError: if the arm is not what it should be; the safety core then stops it.
        """
        if observed.seconds < 0 or self.is_done:
            return np.zeros_like(self.middles)
        if self.joint < 0:
            return self._stand(observed)
        if self._rest_until:
            return self._rest(observed)
        return self._turn(observed)

    def _stand(self, observed: Observed) -> np.ndarray:
        if observed.seconds > SETTLE_S and (fastest := int(np.argmax(np.abs(observed.speeds)))) >= 0:
            speed = observed.speeds[fastest]
            if abs(speed) > DRIFT:
                raise MisfitError(
                    f"joint {fastest + 1} drifts at {speed:.2g} rad/s without torque; let go of the arm, or correct its weight"
                )
        if observed.seconds >= STAND_S:
            self._begin(0, observed)
        return np.zeros_like(self.middles)

    def _rest(self, observed: Observed) -> np.ndarray:
        """Brake until all joints stand, which takes as long as it takes: the next one is measured from there."""
        fastest = float(np.max(np.abs(observed.speeds)))
        if observed.seconds >= self._rest_until and fastest < STANDS:
            self._begin(self.joint + 1, observed)
        elif observed.seconds > self._rest_until + PATIENCE_S:
            raise MisfitError(
                f"the arm does not come to rest after the test of joint {self.joint + 1}: {fastest:.2g} rad/s"
            )
        return np.asarray(-DAMPING * observed.speeds)

    def _begin(self, joint: int, observed: Observed) -> None:
        self.joint, self._began, self._rest_until = joint, observed.seconds, 0.0
        self._from = observed.angles.copy()
        self.is_done = joint == len(self.middles)

    def _turn(self, observed: Observed) -> np.ndarray:
        joint, passed = self.joint, observed.seconds - self._began
        way = 1.0 if self.middles[joint] > self._from[joint] else -1.0
        turned = observed.angles - self._from
        strongest = int(np.argmax(np.abs(turned)))
        size = self.most[joint] * min(passed / PATIENCE_S, 1.0)
        told = f"under {way * size:.2g} N.m at joint {joint + 1}"
        if abs(turned[strongest]) >= TURN:
            if strongest != joint:
                raise MisfitError(
                    f"joint {strongest + 1} turned by {turned[strongest]:.2g} rad {told}; joints are mixed up"
                )
            if turned[joint] * way < 0:
                raise MisfitError(
                    f"joint {joint + 1} turned by {turned[joint]:.2g} rad {told}; its sign, or the side, is wrong"
                )
            self._rest_until = observed.seconds + REST_S
        elif passed >= PATIENCE_S:
            raise MisfitError(f"joint {joint + 1} did not turn {told}; is it held, or its motor off?")
        asked = np.zeros_like(self.middles)
        asked[joint] = way * size
        return asked
