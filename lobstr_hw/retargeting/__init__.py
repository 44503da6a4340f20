"""Motion clips of any common rig, brought onto the standard skeleton."""
