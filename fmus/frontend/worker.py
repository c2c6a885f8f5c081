"""Child process around the Modelica compiler, which can crash on input it does not expect.

Called as `python -m fmus.frontend.worker MODEL FILE ROOT...`; prints the DAE as JSON, or a message with exit code 2.
"""

import json
import os
import sys

from fmus.flat.slim import slim


def main() -> int:
    """Compile one class and print its DAE, with its flat equations beside it."""
    import rumoca

    model, file, *roots = sys.argv[1:]
    # The compiler would read all that this names, beside the files that it is given.
    path = os.environ.pop("MODELICAPATH", None)
    try:
        compiled = rumoca.Session(roots=roots).load(file, model=model)
        dae = compiled.to_dict("dae")
        # The same equations from an earlier stage of the compiler, to check the translation against.
        dae["flat"] = slim(compiled.to_dict("flat"))
        json.dump(dae, sys.stdout)
    except Exception as error:  # the compiler's own exceptions share no useful base class
        print(error, file=sys.stderr)
        return 2
    finally:
        if path is not None:
            os.environ["MODELICAPATH"] = path
    return 0


if __name__ == "__main__":
    sys.exit(main())
