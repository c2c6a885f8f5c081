"""Child process around the Modelica compiler, which can crash on input it does not expect.

Called as `python -m fmus.frontend.worker MODEL FILE ROOT...`; prints the DAE as JSON, or a message with exit code 2.
"""

import json
import sys


def main() -> int:
    """Compile one class and print its DAE."""
    import rumoca

    model, file, *roots = sys.argv[1:]
    try:
        compiled = rumoca.Session(roots=roots).load(file, model=model)
        json.dump(compiled.to_dict("dae"), sys.stdout)
    except Exception as error:  # the compiler's own exceptions share no useful base class
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
