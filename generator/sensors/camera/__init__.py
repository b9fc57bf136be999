"""Cameras: lenses, shutters and the image pipeline from radiance to a photograph.

Renderers return radiance. The image pipeline is one ordered chain, ``image_pipeline.STAGES``: lens
drops, defocus, flare, glare, chromatic aberration, vignetting; image sensor and white balance;
saturation; sharpening and tone; JPEG. Exposure is metered before the chain. A disabled stage draws
no random numbers and costs nothing; ``ideal``, the default, enables only exposure and tone. The
order of stages follows Carlson et al., "Modeling camera effects to improve visual learning from
synthetic data", 2018.
"""
