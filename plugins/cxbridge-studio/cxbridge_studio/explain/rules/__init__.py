"""Why a rule has not fired: its condition is read, matched CE by CE, and what does not match is shown."""
