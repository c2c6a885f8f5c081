"""`python -m orchestrator.cli` is `misfit`."""

from orchestrator.cli.main import main

if __name__ == "__main__":
    main()
