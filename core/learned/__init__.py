"""RandLA-Net for rail points: a classifier that learns from labelled clouds (docs/classification.md, "Learned")."""
