//! One integration binary.

<<<<<<< HEAD
mod effects;
=======
mod recording;
>>>>>>> rec
