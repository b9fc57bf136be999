"""The camera's room: from the radiance that reaches a lens to the bytes of a photograph.

Renderers end at radiance. Everything a camera does to it is one ordered chain,
``image_pipeline.STAGES``: lens drops, defocus, flare, glare, chromatic aberration, vignetting;
image sensor and white balance; saturation; sharpening and tone; JPEG. Exposure is metered before
the chain begins. A stage that is left out draws nothing and costs nothing; ``ideal``, the default,
leaves out all but exposure and tone. Ordered stages make synthetic images transfer: Carlson et al.,
"Modeling camera effects to improve visual learning from synthetic data", 2018.
"""
