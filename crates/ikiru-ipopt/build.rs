//! Finds the system's Ipopt where the feature `link` asks for it, and says what to install where it is missing.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "link")]
    find();
}

/// Documentation and lints look at types alone; with this set they do without the library.
#[cfg(feature = "link")]
const WITHOUT: [&str; 2] = ["IKIRU_IPOPT_CHECK_ONLY", "DOCS_RS"];

#[cfg(feature = "link")]
fn find() {
    for variable in WITHOUT {
        println!("cargo::rerun-if-env-changed={variable}");
        if std::env::var_os(variable).is_some() {
            return;
        }
    }
    // Older versions than 3.11 have not been tried.
    let found = pkg_config::Config::new().atleast_version("3.11").cargo_metadata(false).probe("ipopt");
    let error = match found {
        Ok(library) => {
            // The shared library alone. Debian's ipopt.pc also lists what that one is made of (LAPACK and others),
            // for which its package does not bring what linking needs.
            for folder in library.link_paths {
                println!("cargo::rustc-link-search=native={}", folder.display());
            }
            println!("cargo::rustc-link-lib=dylib=ipopt");
            return;
        }
        Err(error) => error,
    };
    println!(
        "cargo::error=the feature `ipopt` needs the system's Ipopt, 3.11 or newer, and pkg-config. Debian and Ubuntu: \
         `apt-get install coinor-libipopt-dev pkg-config`; Fedora: `dnf install coin-or-Ipopt-devel pkgconf`; \
         macOS: `brew install ipopt pkg-config`. Elsewhere PKG_CONFIG_PATH must name the folder of ipopt.pc"
    );
    for line in error.to_string().lines().filter(|line| !line.trim().is_empty()) {
        println!("cargo::warning={line}");
    }
}
