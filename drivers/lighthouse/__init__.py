"""Lighthouse devices over USB, without SteamVR: what they say and where they are."""
