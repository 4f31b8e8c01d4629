"""Many runs: which ones, where they run, what is kept of each, and what they amount to."""
