//! Errors of compute devices.

/// The reason why a GPU could not be used, or failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// No adapter was found.
    #[error(
        "no GPU was found: there is no graphics driver, or no Vulkan loader to find it by (Debian: libvulkan1 and the driver's \
         package); the CPU gives the same bits"
    )]
    NoAdapter,
    /// No adapter has the requested name, or several have.
    #[error("`{wanted}` matches no adapter, or more than one; available are {known}")]
    UnknownAdapter {
        /// The name as given.
        wanted: String,
        /// All names.
        known: String,
    },
    /// The adapter does not meet the requirements of the shaders.
    #[error(
        "{adapter} cannot run the shaders: it has {found} {what}, but {needed} are needed; use another adapter or the CPU"
    )]
    Inadequate {
        /// The adapter's name.
        adapter: String,
        /// The limit that is too low.
        what: &'static str,
        /// The available amount.
        found: u64,
        /// The required amount.
        needed: u64,
    },
    /// The driver failed to open the device.
    #[error("{adapter} could not be opened: {reason}")]
    NotOpened {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
    /// The device has no memory left.
    #[error("{adapter} is out of memory: {reason}; free some, lower the resolution, or use the CPU")]
    OutOfMemory {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
    /// One buffer would be larger than the adapter allows.
    #[error("{what} need {needed} bytes in one buffer, but {adapter} allows {limit}; use another adapter or the CPU")]
    TooLarge {
        /// The adapter's name.
        adapter: String,
        /// The contents that are too large.
        what: &'static str,
        /// Number of bytes required.
        needed: u64,
        /// Number of bytes allowed.
        limit: u64,
    },
    /// The device is lost: reset, unplugged, or stopped by the driver for taking too long.
    #[error("{adapter} was lost: {reason}; run again, with the CPU if it recurs")]
    Lost {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
    /// The device did not finish some work in time.
    #[error("{adapter} did not finish its work in {seconds} s; lower the resolution, or use the CPU")]
    TimedOut {
        /// The adapter's name.
        adapter: String,
        /// The seconds that were waited.
        seconds: u64,
    },
    /// The driver rejected a shader or a command: a fault of this program, or of the driver.
    #[error("{adapter} rejected a shader or a command: {reason}; please report this, and use the CPU meanwhile")]
    Rejected {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
    /// The device returned an invalid image.
    #[error("{adapter} returned an invalid image: {reason}; please report this, and use the CPU meanwhile")]
    Unsound {
        /// The adapter's name.
        adapter: String,
        /// The problem with the image.
        reason: String,
    },
}
