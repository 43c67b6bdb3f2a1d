"""The command line."""

import sys

STOPPED = "\nstopped; go on with the same command"
INTERRUPTED = 130  #: exit code of what Ctrl-C has ended, 128 and the number of its signal


def main() -> None:
    """Run the command that was typed; Ctrl-C is heeded also while its modules are loaded."""
    try:
        from grainlaw.cli.commands import main as commands

        commands(prog_name="grainlaw")
    except KeyboardInterrupt:
        print(STOPPED, file=sys.stderr)
        sys.exit(INTERRUPTED)
