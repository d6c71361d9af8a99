//! Arguments of `morgana view`.

use super::MemoryArgs;
use super::values::define;
use clap::Args as ClapArgs;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

/// `morgana view`.
#[derive(Debug, ClapArgs)]
pub struct ViewArgs {
    /// Images, readings of meters, volumes and scenes.
    ///
    /// Images: .exr, .png, .npy. Readings of meters and other arrays: .npz, .npy, .h5, .mat. Volumes:
    /// .nrrd, .vol, .vti, .vtk, .vdb, .nii. Scenes: .json, or XML. The page lists all arrays of a
    /// file.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Set a parameter that the scene declares; may be repeated.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,
    /// Port to listen on; 0 for any free port.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// Address to listen on.
    ///
    /// With an address other than loopback, anyone who can reach this machine and knows the token in
    /// the page's address can see the files. Connections are not encrypted.
    #[arg(long, value_name = "IP", default_value_t = Ipv4Addr::LOCALHOST.into())]
    pub listen: IpAddr,
    /// Open the page in the browser.
    #[arg(long)]
    pub open: bool,
    #[command(flatten)]
    pub memory: MemoryArgs,
}
