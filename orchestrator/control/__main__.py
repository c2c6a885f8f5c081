"""Holding the seven postures of the study before and after learning: `python -m orchestrator.control`."""

import os

import numpy as np

ROUNDS = 4


def main() -> None:
    """Print a table of rounds and one of margins."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from orchestrator.control.arm import PERSON, POSTURES, rounds

    found = rounds(PERSON, ROUNDS)
    print("error of the held angles, mrad")
    print(
        f"{'posture q1 q2, rad':22s}"
        + "".join(f"{'round ' + str(k + 1):>10s}" for k in range(ROUNDS))
        + f"{'effort':>20s}"
    )
    for k, posture in enumerate(POSTURES):
        cells = "".join(f"{1e3 * each.held[k].error:10.2f}" for each in found)
        efforts = f"{found[0].held[k].effort:12.4f} -> {found[-1].held[k].effort:.4f}"
        print(f"{np.array2string(posture):22s}{cells}{efforts}")
    print(f"{'root mean square':22s}" + "".join(f"{1e3 * each.error:10.2f}" for each in found))
    print("\nmargins around this arm, last round")
    print(
        f"{'posture q1 q2, rad':22s}{'|I + L|':>10s}{'gain':>16s}{'phase, deg':>16s}{'delay, ms':>12s}{'decay, 1/s':>12s}"
    )
    for posture, each in zip(POSTURES, found[-1].margins, strict=True):
        gain, phase = (" ".join(f"{v:.2f}" for v in part) for part in (each.gain, np.degrees(each.phase)))
        print(
            f"{np.array2string(posture):22s}{each.modulus:10.2f}{gain:>16s}{phase:>16s}{1e3 * each.delay:12.1f}{each.decay:12.2f}"
        )


if __name__ == "__main__":
    main()
