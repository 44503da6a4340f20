"""Full-body avatars from a headset, two controllers and one pelvis tracker: the ground floor."""

__version__ = "0.1.0"
