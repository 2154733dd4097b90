"""Looking at a display: pictures of what it shows, which states these are, the way back from a wrong one."""
