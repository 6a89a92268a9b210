// Depths that mark pixels, so that later passes skip all others before anything is computed: 0 where nothing is asked for.
const float kWholeMark = 0.5;  // one surface fills the pixel
const float kMixedMark = 0.25; // several do
