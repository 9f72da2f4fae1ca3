/// Machine that tries networks: a computer, or a board.
pub trait Bench {
    /// Prints numbers.
    fn numbers(&mut self, name: &str, values: &mut dyn Iterator<Item = f32>);
    /// Runs and measures.
    fn measure(&mut self, name: &str, work: &mut dyn FnMut());
}
