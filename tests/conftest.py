"""What holds for every test."""

import signal

# Tests press Ctrl-C on commands of their own. In a shell's background SIGINT is ignored, and what
# is started there would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
